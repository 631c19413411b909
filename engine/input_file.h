#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// A file that a scene names: in the scene's words (`wreck.ply`, `data:grid.tif`), and where it
/// lies on this machine. Either may be empty if the other is given.
struct InputFile {
  std::string name;
  std::filesystem::path path;

  bool empty() const { return name.empty() && path.empty(); }
};

}  // namespace ensonify::engine
