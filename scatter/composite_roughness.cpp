#include <ensonify/scatter/composite_roughness.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include <ensonify/scatter/reflection.h>

namespace ensonify::scatter {

using std::numbers::inv_sqrtpi;
using std::numbers::pi;

double rms_slope(const Sediment& sediment, double k_per_cm) {
  const double a = sediment.alpha();
  const double s2 =
      std::pow(2.0 * pi * sediment.strength_cm4 * std::pow(k_per_cm * k_per_cm / a, 1.0 - a),
               1.0 / a) /
      (2.0 * (1.0 - a));
  constexpr double steepest = 1e3;  // 89.94 degrees: exponents near 2 would give infinity
  return std::min(std::sqrt(s2), steepest);
}

double slope_cutoff_rad_per_m(const Sediment& sediment, double k_per_cm) {
  const double a = sediment.alpha();
  return 100.0 * std::pow(2.0 * pi * sediment.strength_cm4 * k_per_cm * k_per_cm / a, 0.5 / a);
}

double resolved_slope_fraction(const Sediment& sediment, double k_per_cm, double spacing_m) {
  const double resolved = pi / (spacing_m * slope_cutoff_rad_per_m(sediment, k_per_cm));
  return std::min(1.0, std::pow(resolved, 4.0 - sediment.exponent));
}

double shadowing(double grazing_rad, double slope) {
  const double t = std::tan(grazing_rad) / slope;
  if (!(t <= 2.0)) return 1.0;
  const double Q = (inv_sqrtpi * std::exp(-t * t) - t * std::erfc(t)) / (4.0 * t);
  return -std::expm1(-2.0 * Q) / (2.0 * Q);
}

double slope_average(const std::function<double(double)>& cross_section, double grazing_rad,
                     double slope) {
  constexpr std::array<double, 3> weight = {0.295410, 1.181636, 0.295410};
  constexpr std::array<double, 3> place = {1.224745, 0.0, -1.224745};
  double sum = 0.0;
  for (int i = 0; i < 3; ++i)  // the handbook adds slopes to angles, without an arctangent
    sum += weight[i] * cross_section(std::clamp(grazing_rad - place[i] * slope, 0.0, pi / 2.0));
  return inv_sqrtpi * sum;
}

double perturbation(const Sediment& sediment, double k_per_cm, double grazing_rad) {
  if (sediment.smooth()) return 0.0;
  const double rho = sediment.density_ratio;
  const std::complex<double> kappa = wavenumber_ratio(sediment);
  const std::complex<double> P = vertical_wavenumber_ratio(sediment, grazing_rad);
  const double sine = std::sin(grazing_rad), cosine = std::cos(grazing_rad);
  if (sine == 0.0) return 0.0;  // Y may be undefined there
  const std::complex<double> Y =
      ((rho - 1.0) * (rho - 1.0) * cosine * cosine + rho * rho - kappa * kappa) /
      ((rho * sine + P) * (rho * sine + P));
  // The term 0.1 keeps the spectrum finite at vertical.
  const double K = k_per_cm * std::sqrt(4.0 * cosine * cosine + 0.01);
  return 4.0 * std::pow(k_per_cm * sine, 4.0) * std::norm(Y) * relief_spectrum_cm4(sediment, K);
}

double composite_roughness(const Sediment& sediment, double k_per_cm, double grazing_rad,
                           double slope) {
  const auto flat = [&](double grazing) { return perturbation(sediment, k_per_cm, grazing); };
  return shadowing(grazing_rad, slope) * slope_average(flat, grazing_rad, slope);
}

}  // namespace ensonify::scatter
