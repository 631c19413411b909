#include <ensonify/scatter/large_roughness.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ensonify/scatter/reflection.h>

namespace ensonify::scatter {

using std::numbers::pi;

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

}  // namespace ensonify::scatter
