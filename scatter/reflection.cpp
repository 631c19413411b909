#include <ensonify/scatter/reflection.h>

#include <algorithm>
#include <cmath>

#include <ensonify/scatter/decibel.h>

namespace ensonify::scatter {

std::complex<double> wavenumber_ratio(const Sediment& sediment) {
  return std::complex<double>(1.0, sediment.loss) / sediment.sound_speed_ratio;
}

std::complex<double> vertical_wavenumber_ratio(const Sediment& sediment, double grazing_rad) {
  const std::complex<double> kappa = wavenumber_ratio(sediment);
  // cos^2 is computed as 1 - sin^2, because the cosine loses precision at small grazing angles.
  const double sine = std::sin(grazing_rad);
  return std::sqrt(kappa * kappa - 1.0 + sine * sine);
}

std::complex<double> reflection_coefficient(const Sediment& sediment, double grazing_rad) {
  const double grazing = std::max(grazing_rad, 1e-9);  // gives the limit if sine and P are both 0
  const std::complex<double> P = vertical_wavenumber_ratio(sediment, grazing);
  const double rho_sine = sediment.density_ratio * std::sin(grazing);
  return (rho_sine - P) / (rho_sine + P);
}

double reflection_loss_db(const Sediment& sediment, double grazing_rad) {
  return -to_db(std::norm(reflection_coefficient(sediment, grazing_rad)));
}

}  // namespace ensonify::scatter
