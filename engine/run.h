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

#include <ensonify/engine/image/waterfall.h>
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
/// The same for a run in parts: the finished parts remain, and the same call makes the others.
struct StoppedBetweenParts : Stopped {
  using Stopped::Stopped;
};

/// Share `index` of `count` of a dataset's samples or of a run's parts: consecutive ones.
struct Shard {
  std::size_t index = 0, count = 1;

  /// The share of `all` samples or parts: from begin() until end().
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
  /// By sonar, how much of each object of the seafloor was seen; empty if that was not counted.
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
  /// Whether the caller moves the folder to its place with refine::put_in_place(), which syncs its
  /// files. Otherwise run() syncs each (of a run of one part).
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
  /// Those of the manifest, and of the scene's text and the cache, on which the files do not
  /// depend.
  std::vector<std::string> warnings;
  Extrapolation extrapolation;  ///< not among the warnings
  SeafloorOrigin origin;
  std::vector<std::filesystem::path> files;  ///< by name
  std::size_t parts = 1;                     ///< of the whole run
  std::size_t parts_found = 0;               ///< that were finished before
  bool complete = true;                      ///< false: a share of the parts was made
  StageTimes stages;                         ///< summed over threads
  double prepare_s = 0.0;                    ///< seafloor and surface
  double pings_s = 0.0;                      ///< wall time of all pings
  double files_s = 0.0;                      ///< encoding and writing
  double disk_s = 0.0;                       ///< of all stages: files written, read back, hashed
};

/// Runs a whole scene into a folder (made if missing): its pings in aligned blocks over the
/// threads, each sonar's picture during the pings, its layers and tables at the end, the manifest
/// last.
///
/// A run of one part (see OutputOptions::pings_per_file) that fails or is stopped removes its
/// files. A run in several parts writes each part's files into a folder of its own while the next
/// ones are made; this folder appears complete, in one step. Its images take the memory of a few
/// parts. After a failure or a stop, or if the process is killed, the same call makes the missing
/// parts, to the same bytes. Several processes may share the folder: each part is made by one.
///
/// Throws Stopped, SceneError (also if the folder holds parts of another run, or a file that the
/// scene names would be overwritten), refine::MeshError, MemoryError, std::invalid_argument as
/// Simulator, std::system_error, std::bad_alloc.
RunReport run(const Scene& scene, const std::filesystem::path& folder, const RunControl& control);

/// What merge_run() found.
struct RunMergeReport {
  std::size_t parts = 0;
  std::vector<std::size_t> missing;   ///< parts, counted from 1
  std::vector<std::string> damaged;   ///< one message per file
  std::vector<std::string> warnings;  ///< of the manifest
};

/// Whether a folder holds a run in several parts, finished or not.
bool is_run_in_parts(const std::filesystem::path& folder);

/// Checks the hash of every file of a run in several parts; if all are there and sound, writes the
/// whole run's pictures, targets and manifest. progress(done, of) counts parts; if it returns
/// false, Stopped is thrown. Throws SceneError for a damaged plan, record or picture,
/// std::system_error.
RunMergeReport merge_run(const std::filesystem::path& folder,
                         const std::function<bool(std::size_t done, std::size_t of)>& progress);

}  // namespace ensonify::engine
