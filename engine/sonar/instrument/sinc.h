#pragma once

#include <cmath>
#include <numbers>

namespace ensonify::engine {

/// sin(pi x) / (pi x), without cancellation near 0.
inline double sinc(double x) {
  const double a = std::numbers::pi * x;
  return std::abs(a) < 1e-4 ? 1.0 - a * a / 6.0 : std::sin(a) / a;
}

}  // namespace ensonify::engine
