#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "spread.h"

namespace ensonify::bench {

/// All of it by the clock on the wall, the middle of several turns: a whole scene, from its file to
/// what a run writes; or samples of a dataset.
struct PipelineMeasurement {
  std::string name;  ///< run/BED/SIZE/THREADS or dataset/RECIPE/THREADS
  int threads = 1;
  std::size_t samples = 0;  ///< of a dataset
  std::size_t pings = 0;
  double prepare_s = 0.0, pings_s = 0.0, files_s = 0.0;  ///< of a dataset summed over threads
  double wall_s = 0.0;
  double pings_per_s = 0.0;    ///< of a run's pings_s, of a dataset's wall_s
  double samples_per_s = 0.0;  ///< of a dataset
  Spread speedup;              ///< in pings_per_s over one thread, turn by turn
};

/// Measures the scenes that need no data and a committed recipe, on one thread and on all in turns.
/// Cases whose name holds the pattern, and what they are compared with.
std::vector<PipelineMeasurement> measure_pipeline(
    std::string_view pattern, bool quick, const std::function<void(std::string_view)>& progress);

}  // namespace ensonify::bench
