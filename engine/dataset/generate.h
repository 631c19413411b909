#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/memory.h>
#include <ensonify/engine/scene/extrapolation.h>

namespace ensonify::engine {

/// Part `index` of `count`: whole tars, neighbouring samples.
struct Shard {
  std::size_t index = 0, count = 1;
};

struct GenerateControl {
  int threads = 0;  ///< 0: as many as the machine has
  Shard shard;
  std::filesystem::path cache = {};  ///< for analysed seafloors
  MemoryLimit memory = {};           ///< shared by the samples that are made at one time
  /// Told how many samples of the shard are there. Returning false stops: what is finished stays.
  /// Called from one thread at a time, after every block of pings.
  std::function<bool(std::size_t done, std::size_t of)> progress = {};
  /// Told of each sample that failed, from one thread at a time.
  std::function<void(std::size_t sample, std::string_view why)> failed = {};
};

/// What was done. Times are of this machine, summed over threads, and go into no file.
struct GenerateReport {
  std::size_t samples = 0;  ///< of the shard
  std::size_t found = 0;    ///< that were there before
  std::size_t made = 0;
  std::map<std::size_t, std::string> failed;
  std::map<std::string, double>
      stages_s;  ///< recipe, seafloor, analysis, tree, ping, encode, disk, wait
  double wall_s = 0.0;
  std::vector<std::string> warnings;  ///< of the runs, each once
  Extrapolation extrapolation;        ///< of all runs
  bool stopped = false;
};

/// Makes the samples of a dataset's shard that are not there yet, in a folder (made if missing).
/// The bytes of each depend on the recipe and its number alone. A sample appears at once and whole;
/// one that is stopped leaves nothing, one that is killed what the next call takes away. Several
/// processes may share a folder: nobody makes what another is at, and each returns when its shard
/// is there. A sample that fails does not hold the others up. Throws SceneError for a folder that
/// holds another dataset, std::system_error where the disk refuses.
GenerateReport generate(const Recipe& recipe, const std::filesystem::path& folder,
                        const GenerateControl& control);

/// How many samples of a shard there are, and how many are finished in a folder.
struct ShardState {
  std::size_t samples = 0, finished = 0;
};
ShardState shard_state(const Recipe& recipe, const std::filesystem::path& folder,
                       const Shard& shard);

}  // namespace ensonify::engine
