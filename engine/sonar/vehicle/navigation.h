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
  ReportError position, height;   ///< metres: both east and north; up
  ReportError attitude, heading;  ///< radians: both roll and pitch; heading
  double delay_s = 0.0;           ///< age of a message when a ping uses it
  /// Time between messages; pings repeat a message until the next one. 0: one message per ping.
  double update_interval_s = 0.0;
};

/// The reported pose at a ping of these true poses, numbered from 0. True poses between pings are
/// extrapolated from the nearest ping at its rates. Depends only on the arguments.
Pose reported_pose(const NavigationOptions& options, std::uint64_t seed,
                   std::span<const Pose> poses, std::size_t ping);

}  // namespace ensonify::engine
