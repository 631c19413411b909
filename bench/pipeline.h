#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "spread.h"

namespace ensonify::bench {

/// The wall time of a complete task, as the median of several turns. A task is a run, from the
/// scene file to the written files, or the samples of a dataset.
struct PipelineMeasurement {
  std::string name;  ///< run/BED/SIZE/THREADS or dataset/RECIPE/THREADS
  int threads = 1;
  std::size_t samples = 0;  ///< of a dataset
  std::size_t pings = 0;
  double prepare_s = 0.0, pings_s = 0.0, files_s = 0.0;  ///< for a dataset summed over threads
  double wall_s = 0.0;
  double pings_per_s = 0.0;    ///< for a run in pings_s, for a dataset in wall_s
  double samples_per_s = 0.0;  ///< for a dataset
  Spread speedup;              ///< of pings_per_s over one thread, turn by turn
};

/// Measures a committed recipe and the scenes that need no data, alternately on one thread and on
/// all threads. It measures only cases whose name contains the pattern, and the cases that these
/// are compared with.
std::vector<PipelineMeasurement> measure_pipeline(
    std::string_view pattern, bool quick, const std::function<void(std::string_view)>& progress);

}  // namespace ensonify::bench
