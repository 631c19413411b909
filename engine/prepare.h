#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/memory.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

struct PreparedSeafloor;

/// How a scene is made ready.
struct Preparation {
  std::filesystem::path cache;  ///< the folder for analysed seafloors, made if missing; empty: none
  int threads = 0;              ///< 0: as many as the machine has
  /// Told what comes next ("seafloor", "analysis", "tree"); what it throws ends the preparation.
  std::function<void(std::string_view stage)> progress;
  /// The scene's seafloor where it has been prepared before; none: it is now.
  std::shared_ptr<const PreparedSeafloor> seafloor = {};
  MemoryLimit memory = {};  ///< for all of the process
  double more_bytes = 0.0;  ///< of it that the caller will take, as for a run's images
};

/// A scene's seafloor as its surface needs it.
struct PreparedSeafloor {
  Seafloor seafloor;    ///< with its mesh for `static`, with its progressive mesh for the others
  std::string surface;  ///< the scene's, or what `auto` came to
  std::string why;      ///< that it came to that; empty for what the scene says itself
  std::filesystem::path cache_file;   ///< that it was taken from, or is kept in; empty: none
  bool cached = false;                ///< it was taken from there
  std::vector<std::string> warnings;  ///< of the cache
};

/// Makes a scene's seafloor and, for a surface that needs it, its progressive mesh; or finds both
/// in the cache. A file there that is damaged or of something else is made anew; one that can't be
/// written is a warning. Throws what the seafloor's making throws, SceneError, and MemoryError
/// before memory is allocated that is not there.
PreparedSeafloor prepare_seafloor(const Scene& scene, const Preparation& how);

/// What an analysed seafloor depends on: the scene's seafloor and objects, the contents of their
/// files, the seed, and the versions of what makes it; as a hash of 32 digits.
std::string seafloor_key(const Scene& scene);

/// The file in a cache that a scene's analysed seafloor is taken from, or kept in.
std::filesystem::path cache_file(const Scene& scene, const std::filesystem::path& cache);

/// Where analysed seafloors are kept unless somebody says otherwise: $XDG_CACHE_HOME/ensonify, or
/// ~/.cache/ensonify; empty where there is neither.
std::filesystem::path default_cache();

/// The scene's seafloor made anew. Throws what make_seafloor does; what names a layer or an object,
/// as SceneError with its place in the scene's file; MemoryError for a mesh that does not fit.
Seafloor seafloor_of(const Scene& scene, const MemoryPlan& plan = {});

}  // namespace ensonify::engine
