#include "files_read.h"

#include <string>
#include <system_error>

#include <fmt/format.h>

#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/bed/survey.h>

#include "app.h"

namespace ensonify::engine::app {

namespace fs = std::filesystem;

std::vector<fs::path> files_read(const fs::path& scene_file, const Scene& scene) {
  std::vector<fs::path> files{scene_file};
  for_each_file(scene, [&](const std::string&, const InputFile& file) {
    if (file.path.empty()) return;
    files.push_back(file.path);
    const std::vector<fs::path> behind = files_behind(file.path);
    files.insert(files.end(), behind.begin(), behind.end());
  });
  return files;
}

std::vector<fs::path> files_read(const fs::path& recipe_file, const Recipe& recipe) {
  std::vector<fs::path> files{recipe_file};
  for (const std::string& asset : recipe.assets()) files.push_back(recipe.path_of(asset));
  return files;
}

void require_not_read(const fs::path& output, std::span<const fs::path> read) {
  for (const fs::path& input : read)
    if (std::error_code not_there; fs::equivalent(output, input, not_there))
      throw UsageError(
          fmt::format("{}: this command reads this file ({}), and would overwrite it; name another "
                      "output",
                      output.string(), input.string()));
}

}  // namespace ensonify::engine::app
