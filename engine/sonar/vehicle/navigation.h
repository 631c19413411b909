#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// How far off a reported quantity is, in metres or radians: a bias drawn once, noise drawn for
/// each message, then a step to whose multiples it is rounded.
struct ReportError {
  double bias_rms = 0.0;
  double rms = 0.0;
  double step = 0.0;  ///< 0: not rounded
};

/// What a vehicle says of its pose, as against what it is.
struct NavigationOptions {
  ReportError position, height;   ///< metres: east and north alike; up
  ReportError attitude, heading;  ///< radians: roll and pitch alike
  double delay_s = 0.0;           ///< how old a message is when a ping takes it
  double update_interval_s =
      0.0;  ///< between messages, which pings repeat until the next; 0: one a ping
};

/// What is reported at each of these pings, whose numbers count from 0. Poses between pings are
/// those of the nearest ping at its rates. Depends on nothing but the options, the seed and the
/// true poses.
std::vector<Pose> reported_poses(const NavigationOptions& options, std::uint64_t seed,
                                 std::span<const Pose> poses);

}  // namespace ensonify::engine
