#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// Begins the name of a file in the data folder.
inline constexpr std::string_view data_prefix = "data:";

/// Where a scene's files may lie: a relative path under the scene's folder, or `data:path` under
/// the data folder. Absolute paths, `..`, links that lead out and files that are not regular are
/// refused.
struct ScenePaths {
  std::filesystem::path scene_folder = ".";
  std::filesystem::path data_folder;  ///< empty: none is known
};

/// The paths of a scene's file: its folder is the scene's. Nothing is read.
ScenePaths scene_paths(const std::filesystem::path& file, const std::filesystem::path& data_folder);

/// The absolute path of the file that a key names by `text`. Throws SceneError if it is not there
/// or not allowed; the message has no line number.
std::filesystem::path resolve(std::string_view key, const std::string& text,
                              const ScenePaths& paths);

}  // namespace ensonify::engine
