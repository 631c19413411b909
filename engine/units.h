#pragma once

#include <numbers>

namespace ensonify::engine {

inline constexpr double degree = std::numbers::pi / 180.0;  ///< in radians
inline constexpr double knot_mps = 1852.0 / 3600.0;

}  // namespace ensonify::engine
