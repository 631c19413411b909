#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "support/other_paths.h"

#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::tests {

/// altitude_m above a bed that is 20 m deep.
inline const engine::Pose above_bed{.position = {0.0, 0.0, -10.0}};

inline constexpr double wavelength_m = 0.00375;  ///< 400 kHz at 1500 m/s

/// The coefficient of correlation of two series.
inline double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double mean_a = 0.0, mean_b = 0.0, ab = 0.0, aa = 0.0, bb = 0.0;
  const auto count = static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) mean_a += a[i] / count, mean_b += b[i] / count;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean_a) * (b[i] - mean_b);
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
  }
  return ab / std::sqrt(aa * bb);
}

}  // namespace ensonify::tests
