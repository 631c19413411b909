#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// The error of a reported quantity, in metres or radians: a bias drawn once, noise drawn for each
/// message, then rounding to a multiple of `step`.
struct ReportError {
  double bias_rms = 0.0;
  double rms = 0.0;
  double step = 0.0;  ///< 0: not rounded
};

/// How the reported pose of a vehicle differs from the true one.
struct NavigationOptions {
  ReportError position, height;   ///< metres: `position` is for east and for north, `height` for up
  ReportError attitude, heading;  ///< radians: `attitude` is for roll and for pitch
  double delay_s = 0.0;           ///< age of a message when a ping uses it
  /// Time between messages; pings repeat a message until the next one. 0: one message per ping.
  double update_interval_s = 0.0;
};

/// The pose that the navigation reports at a ping. `poses`: the true poses of all pings. `ping`:
/// index in them. A true pose between pings is extrapolated from the nearest ping at the rates of
/// this ping. Depends only on the arguments.
Pose reported_pose(const NavigationOptions& options, std::uint64_t seed,
                   std::span<const Pose> poses, std::size_t ping);

}  // namespace ensonify::engine
