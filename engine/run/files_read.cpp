#include <ensonify/engine/run/files_read.h>

#include <string>
#include <system_error>

#include <fmt/format.h>

#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/run/output_folder.h>
#include <ensonify/engine/run/run_files.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/bed/survey.h>

namespace ensonify::engine {

namespace fs = std::filesystem;

std::vector<fs::path> files_read(const Scene& scene) {
  std::vector<fs::path> files;
  for_each_file(scene, [&](const std::string&, const InputFile& file) {
    if (file.path.empty()) return;
    files.push_back(file.path);
    const std::vector<fs::path> behind = files_behind(file.path);
    files.insert(files.end(), behind.begin(), behind.end());
  });
  return files;
}

void require_not_read(const fs::path& output, std::span<const fs::path> read) {
  for (const fs::path& input : read)
    if (std::error_code not_there; fs::equivalent(output, input, not_there))
      throw SceneError(
          fmt::format("{}: this file is read ({}), and would be overwritten; name another output",
                      output.string(), input.string()));
}

void require_not_read(const Scene& scene, const fs::path& folder, std::span<const fs::path> read) {
  for (const std::string& name : file_names(scene, "")) require_not_read(folder / name, read);
  for (const fs::path& file : files_of_run(folder)) require_not_read(file, read);
}

}  // namespace ensonify::engine
