#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// A file that a scene names: in the scene's words (`wreck.ply`, `data:grid.tif`), and where it
/// lies on this machine. Both are empty for none.
struct InputFile {
  std::string name;
  std::filesystem::path path;
};

}  // namespace ensonify::engine
