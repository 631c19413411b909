#include <ensonify/engine/sonar/instrument/sonar.h>

#include <algorithm>
#include <cmath>

#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {

double ReceiverOptions::self_noise_density(double speed_mps) const {
  if (!self_noise_db) return 0.0;
  const double faster = std::max(speed_mps / self_noise_speed_mps, 1.0);
  return scatter::from_db(*self_noise_db + self_noise_slope_db * std::log10(faster));
}

Sonar Sonar::sampled(double sound_speed_mps) const {
  Sonar sonar = *this;
  if (sample_rate_hz == 0.0) return sonar;
  const double own_bin_m = 0.5 * sound_speed_mps / sample_rate_hz;
  // The factor keeps a whole number of bins whole in spite of rounding.
  sonar.bins =
      static_cast<int>(std::clamp(std::ceil(range_m / own_bin_m * (1.0 - 1e-9)), 1.0, 1e9));
  sonar.range_m = sonar.bins * own_bin_m;
  return sonar;
}

}  // namespace ensonify::engine
