#include <ensonify/engine/sonar/reception/sonar_equation.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include <ensonify/scatter/ambient_noise.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::engine {
namespace {

using std::numbers::pi;

/// Integral over depression of the one-way vertical pattern.
double vertical_width_rad(const SonarEquation& law, std::size_t sector) {
  constexpr int steps = 3600;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double depression = 2.0 * pi * (i + 0.5) / steps;
    sum += law.vertical(sector, std::cos(depression), std::sin(depression));
  }
  return sum * 2.0 * pi / steps;
}

}  // namespace

// In the plane abeam, `level` is the horizontal direction to starboard and `up` is upwards. A
// positive roll turns the sonar's downward axis to port.
BeamPlane::BeamPlane(const LineContext& context)
    : sector(context.sector),
      cos_pitch(std::sqrt(std::max(1.0 - context.array.axis.z() * context.array.axis.z(), 0.0))),
      sin_pitch(context.array.axis.z()) {
  if (cos_pitch < 1e-6) return;
  const ArrayFrame& array = context.array;
  const double out = context.facing.out;
  const Eigen::Vector3d level = array.axis.cross(Eigen::Vector3d::UnitZ()) / cos_pitch;
  const Eigen::Vector3d up = level.cross(array.axis);
  cos_roll_tilt = -array.down.dot(up);
  sin_roll_tilt = -out * array.down.dot(level);
  const ReceiverMotion& motion = context.motion;
  roll_tilt_per_m = motion.abeam_turn.dot(array.down);
  turn_level_per_m = out * motion.array_turn.dot(level);
  turn_down_per_m = -motion.array_turn.dot(up);
  drift_along = motion.drift_along;
}

SonarEquation::SonarEquation(const Sonar& sonar, double sound_speed_mps, double absorption_db_per_m,
                             const Scatterers& scatterers)
    : bin_m_(sonar.bin_m()),
      cell_m_(sonar.pulse.cell_m(sound_speed_mps)),
      lead_m_(0.5 * sound_speed_mps * sonar.pulse.middle_s()),
      wavelength_m_(sound_speed_mps / sonar.frequency_hz),
      frequency_hz_(sonar.frequency_hz),
      source_level_db_(sonar.source_level_db),
      absorption_db_per_m_(absorption_db_per_m),
      vertical_(VerticalTable::of(sonar)),
      moved_beam_(sonar, wavelength_m_),
      scatterers_(&scatterers) {
  for (std::size_t bin = 0; bin < static_cast<std::size_t>(sonar.bins); ++bin)
    per_m2_.push_back(on_axis(range_m(bin)));
}

double SonarEquation::on_axis(double range_m) const {
  const double squared = range_m * range_m;
  return scatter::from_db(source_level_db_ - 2.0 * absorption_db_per_m_ * range_m) /
         (squared * squared);
}

double SonarEquation::per_m2_at(double range_m) const {
  if (range_m >= this->range_m(bins() - 1)) return on_axis(range_m);
  const double place = std::max(range_m / bin_m_ - 0.5, 0.0);
  const auto bin = static_cast<std::size_t>(place);
  const double share = place - static_cast<double>(bin);
  return per_m2_[bin] + share * (per_m2_[bin + 1] - per_m2_[bin]);
}

double SonarEquation::width_m_at(double range_m) const {
  if (range_m >= this->range_m(bins() - 1)) return scatterers_->width_m_at(range_m);
  return width_m(static_cast<std::size_t>(range_m / bin_m_));
}

double SonarEquation::level_bed(const BeamPlane& plane, double range_m, double sine) const {
  const double down = std::min(sine, 0.9), level = std::sqrt(1.0 - down * down);
  return per_m2_at(range_m) * plane.slant_m(width_m_at(range_m)) * cell_m_ / level *
         two_way(plane, range_m, level * range_m, down * range_m);
}

std::vector<double> sea_noise_powers(const Sonar& sonar, const SonarEquation& law,
                                     const SeaState& sea) {
  // The array receives isotropic noise in a beam that is lambda / L times noise_width_x() wide at
  // all depressions.
  const LineArray array = sonar.receive_array(law.wavelength_m());
  const double width = array.wavelength_m / array.length_m * array.shading.noise_width_x();
  std::vector<double> powers;
  for (std::size_t sector = 0; sector < sonar.sectors().size(); ++sector) {
    const double solid_angle_sr = std::min(width, 2.0) * vertical_width_rad(law, sector);
    const double ambient = scatter::from_db(scatter::ambient_noise_db(sonar.frequency_hz,
                                                                      sea.wind_mps, sea.shipping)) *
                           solid_angle_sr / (4.0 * pi);
    powers.push_back(sonar.pulse.noise_bandwidth_hz() * ambient);
  }
  return powers;
}

}  // namespace ensonify::engine
