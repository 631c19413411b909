#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// A file that a scene names: its name in the scene (`wreck.ply`, `data:grid.tif`) and its path on
/// this machine. One of the two may be empty. A scene that was made in memory may have the content
/// of a file (TrackOptions::log, VerticalPattern::measured, Area::pixels); then the path is empty.
struct InputFile {
  std::string name;
  std::filesystem::path path;

  bool empty() const { return name.empty() && path.empty(); }
};

}  // namespace ensonify::engine
