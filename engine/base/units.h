#pragma once

#include <cmath>

#include <ensonify/scatter/angle.h>

namespace ensonify::engine {

using scatter::degree;
inline constexpr double knot_mps = 1852.0 / 3600.0;  ///< one nautical mile per hour, in m/s

/// A direction in degrees as on a compass: at least 0, less than 360.
inline double compass_deg(double degrees) {
  const double rest = std::fmod(degrees, 360.0);
  const double turned = rest < 0.0 ? rest + 360.0 : rest;
  return turned < 360.0 ? turned : 0.0;  // the sum above may be rounded up to 360
}

}  // namespace ensonify::engine
