#pragma once

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
#include <ensonify/engine/scene/extrapolation.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/sonar/echo/object_view.h>
#include <ensonify/engine/stage_times.h>
#include <ensonify/refine/error.h>

namespace ensonify::engine {

/// Thrown by run() when it was asked to stop.
struct Stopped : Error {
  using Error::Error;
};

/// What a run made, for RunControl::on_outputs; good during that call.
struct RunOutputs {
  const Simulator& simulator;
  /// One per sonar, with the numbers of the labels that its files have.
  std::span<const Waterfall> lines;
  /// By sonar, what was seen of each object of the seafloor; empty where that was not counted.
  std::span<const std::vector<ObjectView>> object_visibility;
};

/// How a run is made, and how it reports to its caller.
struct RunControl {
  int threads = 0;  ///< 0: one per core of the machine
  /// Called with the stage ("seafloor", "analysis", "tree", "pings", "files") and how much of it is
  /// done. Returning false stops the run. Called from one thread at a time, at least after every
  /// block.
  std::function<bool(std::string_view stage, std::size_t done, std::size_t of)> progress;
  std::filesystem::path cache = {};                       ///< as in Preparation
  std::shared_ptr<const PreparedSeafloor> seafloor = {};  ///< as in Preparation
  MemoryLimit memory = {};                                ///< as in Preparation
  std::size_t verify_pings = 0;  ///< how many pings are compared with the exact reference
  bool growing_picture = true;   ///< whether pictures are written during the run
  /// Called once all files except the manifest are written.
  std::function<void(const RunOutputs&)> on_outputs = {};
};

/// What a run did. No file holds its times.
struct RunReport {
  std::map<std::string, std::uint64_t> counts;  ///< pings, rays, hits, starved bins, faces, …
  /// What the comparison with the reference found; empty unless verify_pings was set.
  std::map<std::string, std::uint64_t> verification;
  std::vector<std::string> warnings;
  Extrapolation extrapolation;               ///< not among the warnings
  std::string surface, surface_why;          ///< as in PreparedSeafloor
  std::filesystem::path cache_file;          ///< the same
  bool cached = false;                       ///< the same
  std::vector<std::filesystem::path> files;  ///< by name
  StageTimes stages;                         ///< summed over threads
  double prepare_s = 0.0;                    ///< seafloor and surface
  double pings_s = 0.0;                      ///< wall time of all pings
  double files_s = 0.0;                      ///< encoding and writing
  double disk_s = 0.0;                       ///< of all stages, writing alone
};

/// Runs a whole scene into a folder (made if missing): its pings in aligned blocks over the
/// threads, each sonar's picture while they go on, its layers and tables at the end, the manifest
/// last. On any failure, or a stop, the files of this run are removed again and the reason is
/// thrown: Stopped, SceneError, refine::MeshError, MemoryError, std::system_error.
RunReport run(const Scene& scene, const std::filesystem::path& folder, const RunControl& control);

}  // namespace ensonify::engine
