#include <ensonify/engine/sonar/vehicle/navigation.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <ensonify/engine/base/random.h>

namespace ensonify::engine {
namespace {

constexpr double shortest_interval_s = 1e-6;
// Random streams: one for the biases, one for the noise of each message.
constexpr std::uint64_t bias_stream = 0, message_stream = 1;

/// The true pose at a time, extrapolated from the nearest ping.
Pose pose_at(std::span<const Pose> poses, double t_s) {
  const auto after = std::ranges::lower_bound(poses, t_s, {}, &Pose::t_s);
  const Pose& nearest =
      after == poses.end() || (after != poses.begin() && t_s - (after - 1)->t_s < after->t_s - t_s)
          ? *(after - 1)
          : *after;
  return nearest.after(t_s - nearest.t_s);
}

}  // namespace

Pose reported_pose(const NavigationOptions& options, std::uint64_t seed,
                   std::span<const Pose> poses, std::size_t ping) {
  std::array<double, 6> bias, noise;
  RandomStream(seed, Purpose::navigation, {bias_stream, 0, 0}).normal(bias);
  const double t_s = poses[ping].t_s;
  double measured_s = t_s - options.delay_s;
  auto message = static_cast<std::int64_t>(ping);
  if (options.update_interval_s >= shortest_interval_s) {
    message = static_cast<std::int64_t>(std::floor(measured_s / options.update_interval_s));
    measured_s = static_cast<double>(message) * options.update_interval_s;
  }
  Pose report = measured_s == t_s ? poses[ping] : pose_at(poses, measured_s);
  report.t_s = t_s;
  RandomStream(seed, Purpose::navigation, {message_stream, static_cast<std::uint64_t>(message), 0})
      .normal(noise);
  const auto add_error = [&](double& value, const ReportError& error, std::size_t number) {
    value += error.bias_rms * bias[number] + error.rms * noise[number];
    if (error.step > 0.0) value = std::round(value / error.step) * error.step;
  };
  add_error(report.position.x(), options.position, 0);
  add_error(report.position.y(), options.position, 1);
  add_error(report.position.z(), options.height, 2);
  add_error(report.roll_rad, options.attitude, 3);
  add_error(report.pitch_rad, options.attitude, 4);
  add_error(report.heading_rad, options.heading, 5);
  return report;
}

}  // namespace ensonify::engine
