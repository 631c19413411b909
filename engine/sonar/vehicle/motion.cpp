#include <ensonify/engine/sonar/vehicle/motion.h>

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <ensonify/engine/base/random.h>

namespace ensonify::engine {

Oscillator::Oscillator(const Oscillation& oscillation, std::uint64_t seed, std::uint64_t number) {
  const auto& [rms, period_s, wander_rms, wander_s] = oscillation;
  if (!(rms >= 0.0 && wander_rms >= 0.0 && period_s > 0.0 && wander_s > 0.0))
    throw std::invalid_argument("Oscillator: a negative rms, or a time that is not positive");
  constexpr double relative_half_width = 0.15;  // of the periodic band, divided by its centre
  const double centre_radps = 2.0 * std::numbers::pi / period_s;
  add_band(rms, centre_radps, relative_half_width * centre_radps, seed, number, 0);
  add_band(wander_rms, 0.0, 1.0 / wander_s, seed, number, 1);
}

void Oscillator::add_band(double rms, double centre_radps, double half_width_radps,
                          std::uint64_t seed, std::uint64_t number, std::uint64_t band) {
  constexpr std::size_t strips = 64;
  constexpr double half_widths = 4.0;  // by which a band extends to either side of its centre
  if (rms == 0.0) return;
  std::array<double, 2 * strips> random;
  RandomStream(seed, Purpose::motion, {number, band, 0}).uniform(random);
  const auto below = [](double half_width) { return std::erf(half_width / std::numbers::sqrt2); };
  constexpr double strip = 2.0 * half_widths / strips;
  for (std::size_t k = 0; k < strips; ++k) {
    const double low = static_cast<double>(k) * strip - half_widths;
    const double share = 0.5 * (below(low + strip) - below(low)) / below(half_widths);
    harmonics_.push_back({.amplitude = rms * std::sqrt(2.0 * share),
                          .radps = centre_radps + half_width_radps * (low + strip * random[2 * k]),
                          .phase_rad = 2.0 * std::numbers::pi * random[2 * k + 1]});
  }
}

double Oscillator::at(double t_s) const {
  double sum = 0.0;
  for (const auto& [amplitude, radps, phase_rad] : harmonics_)
    sum += amplitude * std::cos(radps * t_s + phase_rad);
  return sum;
}

double Oscillator::rate(double t_s) const {
  double sum = 0.0;
  for (const auto& [amplitude, radps, phase_rad] : harmonics_)
    sum -= amplitude * radps * std::sin(radps * t_s + phase_rad);
  return sum;
}

double Oscillator::integral(double t_s) const {
  double sum = 0.0;
  for (const auto& [amplitude, radps, phase_rad] : harmonics_) {
    // (sin(w t + p) - sin p) / w, in a form that is accurate for small w t too.
    const double half_rad = 0.5 * radps * t_s;
    const double sinc = half_rad == 0.0 ? 1.0 : std::sin(half_rad) / half_rad;
    sum += amplitude * t_s * sinc * std::cos(half_rad + phase_rad);
  }
  return sum;
}

Motion::Motion(const MotionOptions& options, std::uint64_t seed)
    : options_(options),
      roll_(options.roll, seed, 0),
      pitch_(options.pitch, seed, 1),
      heading_(options.heading, seed, 2),
      heave_(options.heave, seed, 3),
      sway_(options.sway, seed, 4),
      surge_(options.surge, seed, 5),
      speed_(options.speed, seed, 6) {}

Pose Motion::applied_to(const Pose& track) const {
  Pose pose = track;
  const double t_s = track.t_s;
  const double s = std::sin(track.heading_rad), c = std::cos(track.heading_rad);
  const Eigen::Vector3d ahead{s, c, 0.0}, starboard{c, -s, 0.0};
  const double surge_m = surge_.at(t_s), sway_m = sway_.at(t_s);
  pose.position += surge_m * ahead + sway_m * starboard;
  pose.position.z() += heave_.at(t_s);
  // Surge and sway turn with the course, which adds to the velocity.
  pose.velocity_mps += (surge_.rate(t_s) - sway_m * track.heading_rate_radps) * ahead +
                       (sway_.rate(t_s) + surge_m * track.heading_rate_radps) * starboard;
  pose.velocity_mps.z() += heave_.rate(t_s);
  pose.roll_rad += options_.roll_rad + roll_.at(t_s);
  pose.roll_rate_radps += roll_.rate(t_s);
  pose.pitch_rad += options_.pitch_rad + pitch_.at(t_s);
  pose.pitch_rate_radps += pitch_.rate(t_s);
  pose.heading_rad += options_.crab_rad + heading_.at(t_s);
  pose.heading_rate_radps += heading_.rate(t_s);
  return pose;
}

}  // namespace ensonify::engine
