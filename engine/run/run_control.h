#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/target_record.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/preparation.h>
#include <ensonify/engine/scene/checks/extrapolation.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/sonar/echo/object_visibility.h>
#include <ensonify/engine/stage_times.h>
#include <ensonify/refine/error.h>

namespace ensonify::engine {

/// Thrown by run() when it was asked to stop.
struct Stopped : Error {
  using Error::Error;
};
/// Thrown by a run in several parts when it was asked to stop: the finished parts remain, and the
/// same call of run() makes the missing parts.
struct StoppedBetweenParts : Stopped {
  using Stopped::Stopped;
};

/// Share number `index` (from 0) of `count` shares: consecutive samples of a dataset, or
/// consecutive parts of a run.
struct Shard {
  std::size_t index = 0, count = 1;

  /// The share of `all` samples or parts is [begin(all), end(all)).
  std::size_t begin(std::size_t all) const { return all * index / count; }
  std::size_t end(std::size_t all) const { return all * (index + 1) / count; }
};

/// The size of a run in parts, known before its first ping.
struct RunSize {
  std::size_t parts = 0, pings = 0;
  std::size_t finished_parts = 0;  ///< found in the folder
  double max_disk_bytes = 0.0;     ///< of the files of the missing parts, without tables of targets
  double memory_bytes = 0.0;       ///< of the images
};

/// What a run made, for RunControl::on_outputs; valid during that call.
struct RunOutputs {
  const Simulator& simulator;
  /// One per sonar, with the numbers of the labels that its files have.
  std::span<const Waterfall> lines;
  std::span<const Picture> pictures;  ///< one per sonar, the picture in NAME.png
  /// One list per sonar, the targets in NAME_targets.json.
  std::span<const std::vector<TargetRecord>> targets;
  /// For each sonar, how much of each object of the seafloor it saw; empty if this was not counted.
  std::span<const std::vector<ObjectVisibility>> object_visibility;
};

/// How a run is made, and how it reports to its caller.
struct RunControl {
  int threads = 0;  ///< 0: one per core of the machine
  /// Called with the stage ("seafloor", "analysis", "tree", "pings", "files") and how much of it is
  /// done. Returning false stops the run. Called from one thread at a time, now and then within a
  /// stage too.
  std::function<bool(std::string_view stage, std::size_t done, std::size_t of)> progress;
  std::filesystem::path cache = {};                       ///< as in Preparation
  std::shared_ptr<const PreparedSeafloor> seafloor = {};  ///< as in Preparation
  MemoryLimit memory = {};                                ///< as in Preparation
  std::size_t verify_pings = 0;  ///< how many pings are compared with the exact reference
  bool growing_picture = true;   ///< whether pictures are written during the run
  /// Whether the caller moves the folder to its place with refine::put_in_place(), which writes its
  /// files to the disk (sync). If not, run() does this for a run of one part.
  bool staged = false;
  /// Which parts of a run in several parts are made. After all shares are made, merge_run()
  /// completes the run. A share without parts makes no pings, and a warning reports it.
  Shard shard = {};
  /// Called before the first ping of a run in several parts.
  std::function<void(const RunSize&)> on_parts = {};
  /// Called once all files except the manifest are written. If this is set, the run has one part.
  std::function<void(const RunOutputs&)> on_outputs = {};
};

/// What a run did. Its times are in no file.
struct RunReport {
  std::map<std::string, std::uint64_t> counts;  ///< pings, rays, hits, starved bins, faces, …
  /// What the comparison with the reference found; empty unless verify_pings was set.
  std::map<std::string, std::uint64_t> verification;
  /// The warnings of the manifest, and also those about the scene's text and the cache, which the
  /// manifest does not have because the files do not depend on them.
  std::vector<std::string> warnings;
  Extrapolation extrapolation;  ///< not among the warnings
  SeafloorOrigin origin;
  std::vector<std::filesystem::path> files;  ///< by name
  std::size_t parts = 1;                     ///< of the whole run
  std::size_t parts_found = 0;               ///< parts that were finished before this call
  bool complete = true;                      ///< false: only a share of the parts was made
  StageTimes stages;                         ///< summed over threads
  double prepare_s = 0.0;                    ///< seafloor and surface
  double pings_s = 0.0;                      ///< wall time of all pings
  double files_s = 0.0;                      ///< encoding and writing
  double disk_s = 0.0;                       ///< of all stages: files written, read back, hashed
};

}  // namespace ensonify::engine
