#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// A file that a scene names: as written in the scene (`wreck.ply`, `data:grid.tif`), and its path
/// on this machine. Either may be empty if the other is given.
struct InputFile {
  std::string name;
  std::filesystem::path path;

  bool empty() const { return name.empty() && path.empty(); }
};

}  // namespace ensonify::engine
