#include <ensonify/engine/sonar/instrument/beam_pattern.h>

#include <numbers>
#include <span>

#include <ensonify/engine/sonar/instrument/sinc.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;
constexpr double half_power_sinc = 0.442946;  // where sinc^2 has fallen to one half
constexpr double lowest_formula_db = -20.0;

double interpolated_db(std::span<const VerticalLevel> levels, double depression_rad) {
  const auto above =
      std::ranges::upper_bound(levels, depression_rad, {}, &VerticalLevel::depression_rad);
  if (above == levels.begin()) return levels.front().level_db;
  if (above == levels.end()) return levels.back().level_db;
  const VerticalLevel &a = *(above - 1), &b = *above;
  const double share = (depression_rad - a.depression_rad) / (b.depression_rad - a.depression_rad);
  return a.level_db + share * (b.level_db - a.level_db);
}

}  // namespace

double LineArray::power(double sin_psi) const {
  const double amplitude = shading.far_field(length_m * sin_psi / wavelength_m);
  return amplitude * amplitude;
}

double LineArray::power(double sin_psi, double range_m, double defocus) const {
  return std::norm(shading.field(length_m * sin_psi / wavelength_m, nearness(range_m, defocus)));
}

double LineArray::null_rad(int number) const {
  return std::asin(std::min(1.0, shading.null_x(number) * wavelength_m / length_m));
}

double VerticalPattern::power(double depression_rad, const Sector& sector) const {
  std::span<const VerticalLevel> levels;
  double mount_rad = 0.0;
  if (sector.element) {
    mount_rad = sector.element->axis_rad - tilt_rad;
  } else {
    levels = measured[sector.number];
    mount_rad = sector.number == 0 ? port_mount_rad : starboard_mount_rad;
  }
  const double depression = std::remainder(depression_rad - mount_rad, 2.0 * pi);
  double power = 1.0;
  if (!levels.empty()) {
    power = scatter::from_db(interpolated_db(levels, depression));
  } else if (beamwidth_rad > 0.0) {
    const double off_axis = std::remainder(depression - tilt_rad, 2.0 * pi);
    const double s = sinc(half_power_sinc * std::sin(off_axis) / std::sin(beamwidth_rad / 2.0));
    power = std::abs(off_axis) < pi / 2.0 ? s * s : 0.0;  // the element's back does not radiate
  }
  if (ripple_db > 0.0) {
    const double turns = (depression - ripple_dark_rad) / ripple_period_rad;
    power *= scatter::from_db(-0.5 * ripple_db * (1.0 + std::cos(2.0 * pi * turns)));
  }
  // The element's back begins at a right angle to its axis.
  if (floor_below_db && depression >= tilt_rad && depression <= pi / 2.0 + std::max(tilt_rad, 0.0))
    power = std::max(power, scatter::from_db(*floor_below_db));
  if (floor_db) return std::max(power, scatter::from_db(*floor_db));
  return levels.empty() ? std::max(power, scatter::from_db(lowest_formula_db)) : power;
}

}  // namespace ensonify::engine
