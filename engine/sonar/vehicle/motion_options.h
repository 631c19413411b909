#pragma once

namespace ensonify::engine {

/// How one degree of freedom moves about its mean: driven by waves, wandering slowly, or both.
/// In radians, metres or m/s, as the degree of freedom is.
struct Oscillation {
  double rms = 0.0;  ///< of the part with a period
  double period_s = 8.0;
  double wander_rms = 0.0;  ///< of the slow part
  double wander_s = 60.0;   ///< its correlation time

  bool still() const { return rms == 0.0 && wander_rms == 0.0; }
};

/// What a vehicle does about its track: a steady attitude, and movements.
struct MotionOptions {
  double roll_rad = 0.0, pitch_rad = 0.0;  ///< added to the track's
  double crab_rad = 0.0;                   ///< the heading's angle to starboard of the course
  Oscillation roll, pitch, heading;        ///< radians
  Oscillation heave, sway, surge;          ///< metres: up, to starboard and ahead of the course
  Oscillation speed;                       ///< m/s, of a generated track
};

}  // namespace ensonify::engine
