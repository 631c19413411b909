#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// The beginning of the name of a file in the data folder.
inline constexpr std::string_view data_prefix = "data:";

/// The folders of a scene's files. A file has a relative path in the scene's folder, or `data:path`
/// in the data folder. Absolute paths, `..`, links that lead out of the folder, and files that are
/// not regular are refused.
struct ScenePaths {
  std::filesystem::path scene_folder = ".";
  std::filesystem::path data_folder;  ///< empty: unknown
};

/// The folders for a scene file: its own folder and the data folder. Nothing is read.
ScenePaths scene_paths(const std::filesystem::path& file, const std::filesystem::path& data_folder);

/// The absolute path of the file that the key `key` names by `text`. Throws SceneError if the file
/// does not exist or is not allowed; the message has no line number.
std::filesystem::path resolve(std::string_view key, const std::string& text,
                              const ScenePaths& paths);

}  // namespace ensonify::engine
