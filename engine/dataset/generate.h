#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/base/memory.h>
#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/checks/extrapolation.h>

namespace ensonify::engine {

struct GenerateControl {
  int threads = 0;                   ///< 0: one per core of the machine
  Shard shard;                       ///< a shard consists of whole tars
  std::filesystem::path cache = {};  ///< for analysed seafloors
  MemoryLimit memory = {};           ///< shared by the samples that are made at the same time
  /// Called with the number of finished samples of the shard. If it returns false, generate stops;
  /// finished samples stay. Called by one thread at a time, after every block of pings.
  std::function<bool(std::size_t done, std::size_t of)> progress = {};
  /// Called for each sample that failed, by one thread at a time.
  std::function<void(std::size_t sample, std::string_view why)> failed = {};
};

/// What generate() did. Times are summed over threads; no file contains them.
struct GenerateReport {
  std::size_t samples = 0;  ///< in the shard
  std::size_t found = 0;    ///< finished before, or made by another process
  std::size_t made = 0;
  std::map<std::size_t, std::string> failed;  ///< by sample: the reason
  /// By stage: recipe, seafloor, analysis, tree, ping, encode, disk, wait.
  std::map<std::string, double> stages_s;
  double wall_s = 0.0;
  std::vector<std::string> warnings;  ///< of the runs; those that differ only in digits once
  Extrapolation extrapolation;        ///< of all runs
  bool stopped = false;
};

/// Makes the missing samples of a dataset's shard in a folder, which is created if necessary. The
/// bytes of a sample depend only on the recipe and the sample's number. A sample appears complete,
/// in one step. A call that is stopped leaves no incomplete samples, and the next call removes the
/// incomplete samples that a killed process left. Several processes may share a folder: each sample
/// is made by one process, and each process returns when its shard is complete. If a sample fails,
/// the others are still made. Throws SceneError if the folder contains another dataset, and
/// std::system_error if the disk cannot be written.
GenerateReport generate(const Recipe& recipe, const std::filesystem::path& folder,
                        const GenerateControl& control);

/// The number of samples in a shard, and how many of them are finished in a folder. Throws
/// SceneError if the folder contains another dataset.
struct ShardState {
  std::size_t samples = 0, finished = 0;
};
ShardState shard_state(const Recipe& recipe, const std::filesystem::path& folder,
                       const Shard& shard);

}  // namespace ensonify::engine
