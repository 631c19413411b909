#include <ensonify/engine/sonar/beam_pattern.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

constexpr double half_power_sinc = 0.442946;  // where sinc^2 has fallen to one half

double sinc(double x) {
  const double a = std::numbers::pi * x;
  return std::abs(a) < 1e-4 ? 1.0 - a * a / 6.0 : std::sin(a) / a;
}

}  // namespace

double LineArray::power(double sin_psi) const {
  const double s = sinc(length_m * sin_psi / wavelength_m);
  return s * s;
}

double LineArray::first_null_rad() const {
  return std::asin(std::min(1.0, wavelength_m / length_m));
}

double VerticalPattern::power(double depression_rad) const {
  if (beamwidth_rad == 0.0) return 1.0;
  const double floor = scatter::from_db(floor_db);
  const double off_axis = std::remainder(depression_rad - tilt_rad, 2.0 * std::numbers::pi);
  if (std::abs(off_axis) >= std::numbers::pi / 2.0) return floor;  // the element's back
  const double s = sinc(half_power_sinc * std::sin(off_axis) / std::sin(beamwidth_rad / 2.0));
  return std::max(s * s, floor);
}

}  // namespace ensonify::engine
