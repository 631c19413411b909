#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// Where a scene's files may lie: a relative path under the scene's folder, or `data:path` under
/// the data folder. Absolute paths, `..`, links that lead out and files that are not regular are
/// refused.
struct ScenePaths {
  std::filesystem::path scene_folder = ".";
  std::filesystem::path data_folder;  ///< empty: none is known
};

/// Those of a scene's file.
ScenePaths scene_paths(const std::filesystem::path& file, const std::filesystem::path& data_folder);

/// The file that a key names by `text`. Throws SceneError without a place.
std::filesystem::path resolve(std::string_view key, const std::string& text,
                              const ScenePaths& paths);

}  // namespace ensonify::engine
