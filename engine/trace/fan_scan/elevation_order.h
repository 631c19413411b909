#pragma once

#include <cstdint>

namespace ensonify::engine {

/// The rays of a fan's plane in the order of q, as plain arrays for the kernels (see FanTables).
struct ElevationOrder {
  const double* ascending;
  const std::uint64_t* lines;
  double first_q, steps_per_q, steps;
};

}  // namespace ensonify::engine
