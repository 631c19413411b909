#pragma once

#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// The position and direction of a sonar on its vehicle. The sonar's x axis is along the array.
struct Mounting {
  double forward_m = 0.0;  ///< from the vehicle's reference point
  double starboard_m = 0.0;
  double down_m = 0.0;
  /// Turns the array to starboard; at -90 degrees the starboard side looks ahead.
  double azimuth_rad = 0.0;
  double pitch_rad = 0.0;  ///< after that turn, lifts the front end
  /// Whether the array then lies across: its x axis points to port, and the sonar looks ahead.
  bool across = false;

  bool operator==(const Mounting&) const = default;
  /// This mounting, moved forwards along the array by `along_m`.
  Mounting ahead(double along_m) const;
};

/// The pose and rates of a sonar mounted on a vehicle, as parts of one rigid body.
Pose mounted(const Pose& vehicle, const Mounting& mounting);

}  // namespace ensonify::engine
