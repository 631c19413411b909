#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// A file that a scene names: as written in the scene (`wreck.ply`, `data:grid.tif`), and its path
/// on this machine. Both are empty if there is no file.
struct InputFile {
  std::string name;
  std::filesystem::path path;
};

}  // namespace ensonify::engine
