#include <ensonify/engine/scene/scene_paths.h>

#include <algorithm>
#include <system_error>

#include <fmt/format.h>

#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/toml_value.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {

namespace fs = std::filesystem;

ScenePaths scene_paths(const fs::path& file, const fs::path& data_folder) {
  return {file.has_parent_path() ? file.parent_path() : fs::path("."), data_folder};
}

fs::path resolve(std::string_view key, const std::string& text, const ScenePaths& paths) {
  const auto refuse = [&](std::string_view why) {
    return SceneError(fmt::format("'{}' names {}: {}", key, quoted_toml(text), why));
  };
  const bool in_data = text.starts_with(data_prefix);
  if (in_data && paths.data_folder.empty())
    throw refuse("no data folder is known: give --data DIR or set ENSONIFY_DATA");
  const fs::path inside = in_data ? text.substr(data_prefix.size()) : text;
  if (text.find('\0') != std::string::npos) throw refuse("a path holds no NUL character");
  if (inside.is_absolute() || std::ranges::count(inside, fs::path("..")) > 0)
    throw refuse("expected a path under the scene's own folder, without '..', or data:path");

  std::error_code error;
  const fs::path folder = fs::canonical(in_data ? paths.data_folder : paths.scene_folder, error);
  if (error)
    throw refuse(fmt::format("the folder {}: {}",
                             (in_data ? paths.data_folder : paths.scene_folder).string(),
                             error.message()));
  fs::path file = fs::canonical(folder / inside, error);
  if (error) throw refuse(fmt::format("{} ({})", error.message(), (folder / inside).string()));
  if (!lies_below(file, folder))
    throw refuse(fmt::format("a link leads out of {}", folder.string()));
  if (const std::string fault = refine::fault_of_file(file); !fault.empty()) throw refuse(fault);
  return file;
}

}  // namespace ensonify::engine
