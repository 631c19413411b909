#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "spread.h"

namespace ensonify::bench {

/// The cost of an effect per ping, from alternate pings with and without the effect.
struct CostMeasurement {
  std::string name;
  std::size_t faces = 0;
  Spread without_ms, with_ms;  ///< thread time
  double ratio = 0.0;          ///< the median of the pairs' ratios
};

/// The cost of labels, over a wreck on a seabed of several sediments and features (skipped without
/// the wreck, mesh_underwater/skytteren_wreck.ply in the data folder); of refraction, over ripples
/// and a fractal bed under a strong thermocline; of the signal chain and each of its effects. Only
/// cases whose name contains the filter.
std::vector<CostMeasurement> measure_costs(std::string_view filter,
                                           const std::filesystem::path& data, int rounds,
                                           int pings);

}  // namespace ensonify::bench
