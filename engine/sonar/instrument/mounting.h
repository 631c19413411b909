#pragma once

#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// Where on the vehicle a sonar sits and how it is turned. Its own x axis is the array's.
struct Mounting {
  double forward_m = 0.0;  ///< from the vehicle's point of reference
  double starboard_m = 0.0;
  double down_m = 0.0;
  double azimuth_rad = 0.0;  ///< turns the array to starboard: at -90 degrees starboard looks ahead
  double pitch_rad = 0.0;    ///< then lifts its fore end

  bool operator==(const Mounting&) const = default;
};

/// The pose of a sonar on a vehicle, with its rates: those of a rigid body.
Pose mounted(const Pose& vehicle, const Mounting& mounting);

}  // namespace ensonify::engine
