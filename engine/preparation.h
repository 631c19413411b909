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
  /// Above this the files of the cache that were used longest ago are removed.
  std::uintmax_t cache_limit_bytes = std::uintmax_t{16} << 30;
  int threads = 0;  ///< 0: one per core of the machine
  /// Called with the name of a stage ("seafloor", "analysis", "tree") when the stage begins, and
  /// now and then while it lasts; by one thread at a time. What it throws ends the preparation.
  std::function<void(std::string_view stage)> progress;
  /// Called now and then during a ping, while an object is added, while a track is made, and while
  /// the exact reference's tree and the grid for altitudes are made; by any thread. What it throws
  /// ends the call.
  std::function<void()> stop_check = {};
  /// The scene's seafloor, if the library has made it before (as for the samples of a dataset);
  /// null: it is made. It is shared, not copied. Programs leave it null.
  std::shared_ptr<const PreparedSeafloor> seafloor = {};
  MemoryLimit memory = {};  ///< for the whole process
  double more_bytes = 0.0;  ///< the part that the caller will use, e.g. for images
};

/// How a seafloor was prepared.
struct SeafloorOrigin {
  std::string surface;               ///< the scene's face source, or the one that `auto` chose
  std::string why;                   ///< why `auto` chose it; empty if the scene names one
  std::filesystem::path cache_file;  ///< in the cache, which was read or written; empty: none
  bool cached = false;               ///< whether it was read from this file
};

/// Where analysed seafloors are kept by default: $XDG_CACHE_HOME/ensonify, or
/// ~/.cache/ensonify; empty where there is neither.
std::filesystem::path default_cache();

}  // namespace ensonify::engine
