#pragma once

#include <cmath>

#include <ensonify/scatter/angle.h>

namespace ensonify::engine {

using scatter::degree;
inline constexpr double knot_mps = 1852.0 / 3600.0;  ///< a nautical mile per hour

/// A direction in degrees as a compass has it, from 0 up to 360.
inline double compass_deg(double degrees) {
  const double rest = std::fmod(degrees, 360.0);
  const double turned = rest < 0.0 ? rest + 360.0 : rest;
  return turned < 360.0 ? turned : 0.0;  // a sum may be rounded up
}

}  // namespace ensonify::engine
