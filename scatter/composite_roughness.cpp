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

double critical_angle_deg(const Sediment& sediment) {
  if (sediment.sound_speed_ratio < 1.001) return 2.5613;
  return std::acos(1.0 / sediment.sound_speed_ratio) * 180.0 / pi;
}

double large_roughness(const Sediment& sediment, double grazing_rad, double slope) {
  if (sediment.smooth()) return 0.0;
  constexpr double gentlest = 1e-50;  // exponents near 2 may give a slope of 0
  const double s = std::max(slope, gentlest);
  const double rho = sediment.density_ratio, nu = sediment.sound_speed_ratio;
  const double theta = grazing_rad * 180.0 / pi;  // the formula uses degrees
  const double theta_s = s * 180.0 / pi;
  const double theta_c = critical_angle_deg(sediment);
  const double R2 = std::norm(reflection_coefficient(sediment, pi / 2.0));

  const double m = 0.7263 * std::pow(s, -1.0 / 3.0);
  const double stiffness = (1.0 - 2.0 / rho) / (nu * nu) + 1.0;
  const double sigma1 = 0.04682 * std::pow(s, 1.25) * std::pow(nu, 3.25) * stiffness * stiffness /
                        (1.0 + 3.54 * theta_s / theta_c);
  const double cr = 1.0 + 0.81 * theta_c * theta_c / (theta * theta);
  const double away = (theta - 90.0) * (theta - 90.0) / (2.6 * theta_s * theta_s);
  return sigma1 * std::pow(std::max(0.0, std::sin(pi / cr)), m) +
         0.0260 * R2 / (s * s * std::pow(1.0 + away, 1.9) * cr);
}

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
