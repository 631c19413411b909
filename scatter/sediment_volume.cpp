#include <ensonify/scatter/sediment_volume.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <ensonify/scatter/composite_roughness.h>
#include <ensonify/scatter/reflection.h>

namespace ensonify::scatter {

double flat_sediment_volume(const Sediment& given, double grazing_rad) {
  const double sine = std::sin(grazing_rad);
  if (sine == 0.0) return 0.0;
  Sediment sediment = given;
  sediment.loss = std::max(sediment.loss, 1e-9);  // avoids 0/0
  const std::complex<double> R = reflection_coefficient(sediment, grazing_rad);
  const std::complex<double> P = vertical_wavenumber_ratio(sediment, grazing_rad);
  return 5.0 * sediment.loss * sediment.volume * std::norm(1.0 - R * R) * sine * sine /
         (sediment.sound_speed_ratio * std::numbers::ln10 * std::norm(P) * P.imag());
}

double sediment_volume(const Sediment& sediment, double grazing_rad, double slope) {
  const auto flat = [&](double grazing) { return flat_sediment_volume(sediment, grazing); };
  return shadowing(grazing_rad, slope) * slope_average(flat, grazing_rad, slope);
}

}  // namespace ensonify::scatter
