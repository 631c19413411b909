#include <ensonify/engine/sonar/instrument/sonar.h>

#include <algorithm>
#include <cmath>

namespace ensonify::engine {

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
