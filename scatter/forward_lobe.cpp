#include <ensonify/scatter/forward_lobe.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ensonify/scatter/kirchhoff.h>
#include <ensonify/scatter/reflection.h>

namespace ensonify::scatter {

double forward_lobe(const Sediment& sediment, double k_per_cm, double grazing_in_rad,
                    double grazing_out_rad, double turned_rad) {
  constexpr double vertical_rad = 0.5 * std::numbers::pi;
  // Components of q / 2 k. They are computed with sines of half angles, because small differences
  // of angles then stay exact.
  const double sum_rad = 0.5 * (grazing_in_rad + grazing_out_rad);
  const double difference_rad = 0.5 * (grazing_in_rad - grazing_out_rad);
  const double vertical = std::sin(sum_rad) * std::cos(difference_rad);
  const double level = std::hypot(
      std::sin(sum_rad) * std::sin(difference_rad),
      std::sqrt(std::cos(grazing_in_rad) * std::cos(grazing_out_rad)) * std::sin(0.5 * turned_rad));
  const double half = std::min(std::hypot(vertical, level), 1.0);
  return kirchhoff(sediment, k_per_cm * half, std::atan2(vertical, level)) *
         std::norm(reflection_coefficient(sediment, std::asin(half))) /
         std::norm(reflection_coefficient(sediment, vertical_rad));
}

}  // namespace ensonify::scatter
