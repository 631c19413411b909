#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "spread.h"

namespace ensonify::bench {

/// What something costs a ping: pings with it and pings without, in turns.
struct CostMeasurement {
  std::string name;
  std::size_t faces = 0;
  Spread without_ms, with_ms;  ///< of this thread's own time
  double ratio = 0.0;          ///< the median of the pairs' ratios
};

/// Labels over a wreck on a seabed of several sediments and features (skipped without the wreck,
/// which is mesh_underwater/skytteren_wreck.ply in the folder of data), and refraction over ripples
/// and rock under a strong thermocline; the signal chain and each of its effects. Cases whose name
/// holds the filter.
std::vector<CostMeasurement> measure_costs(std::string_view filter,
                                           const std::filesystem::path& data, int rounds,
                                           int pings);

}  // namespace ensonify::bench
