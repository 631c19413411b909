#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace ensonify::bench {

/// A whole scene, from its file to all that a run writes, by the clock on the wall.
struct PipelineMeasurement {
  std::string name;  ///< run/SCENE/THREADS
  int threads = 1;
  std::size_t pings = 0;
  double prepare_s = 0.0, pings_s = 0.0, files_s = 0.0;
  double pings_per_s = 0.0;
};

/// Runs the scenes that need no data, on one thread and on all. Cases whose name holds the pattern.
std::vector<PipelineMeasurement> measure_pipeline(
    std::string_view pattern, bool quick, const std::function<void(std::string_view)>& progress);

}  // namespace ensonify::bench
