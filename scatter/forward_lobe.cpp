#include <ensonify/scatter/forward_lobe.h>

#include <cmath>
#include <numbers>

#include <ensonify/scatter/kirchhoff.h>
#include <ensonify/scatter/reflection.h>

namespace ensonify::scatter {

double forward_lobe(const Sediment& sediment, double k_per_cm, double grazing_in_rad,
                    double grazing_out_rad) {
  constexpr double vertical_rad = 0.5 * std::numbers::pi;
  const double facet_rad = 0.5 * (grazing_in_rad + grazing_out_rad);
  const double inclined_rad = 0.5 * std::abs(grazing_in_rad - grazing_out_rad);
  return kirchhoff(sediment, k_per_cm * std::sin(facet_rad), vertical_rad - inclined_rad) *
         std::norm(reflection_coefficient(sediment, facet_rad)) /
         std::norm(reflection_coefficient(sediment, vertical_rad));
}

}  // namespace ensonify::scatter
