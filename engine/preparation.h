#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <ensonify/engine/base/memory.h>

namespace ensonify::engine {

struct PreparedSeafloor;

/// How a scene is made ready.
struct Preparation {
  std::filesystem::path cache;  ///< folder for analysed seafloors, made if missing; empty: none
  /// If the cache is larger, the files that were used longest ago are removed.
  std::uintmax_t cache_limit_bytes = std::uintmax_t{16} << 30;
  int threads = 0;  ///< 0: one per core of the machine
  /// Called with the name of a stage ("seafloor", "analysis", "tree") when the stage begins, and
  /// again while it lasts; by one thread at a time. It may throw to end the preparation.
  std::function<void(std::string_view stage)> progress;
  /// Called repeatedly, by any thread: during a ping, while an object is added, while a track is
  /// made, and while the exact reference's tree and the grid for altitudes are made. An exception
  /// that it throws ends the call.
  std::function<void()> stop_check = {};
  /// The scene's seafloor, if the library has made it before, as for the samples of a dataset; it
  /// is shared, not copied. Null: the seafloor is made. Programs leave this null.
  std::shared_ptr<const PreparedSeafloor> seafloor = {};
  MemoryLimit memory = {};  ///< for the whole process
  double more_bytes = 0.0;  ///< what the caller itself will use, e.g. for images
};

/// How a seafloor was prepared.
struct SeafloorOrigin {
  std::string surface;               ///< the face source that the scene names or that `auto` chose
  std::string why;                   ///< why `auto` chose it; empty if the scene names one
  std::filesystem::path cache_file;  ///< that was read or written; empty: none
  bool cached = false;               ///< whether the seafloor was read from this file
};

/// The default folder for analysed seafloors: $XDG_CACHE_HOME/ensonify, or ~/.cache/ensonify; empty
/// if neither XDG_CACHE_HOME nor HOME is an absolute path.
std::filesystem::path default_cache();

}  // namespace ensonify::engine
