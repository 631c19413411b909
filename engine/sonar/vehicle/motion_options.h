#pragma once

namespace ensonify::engine {

/// The random movement of one degree of freedom about its mean: a part driven by waves, a slow
/// wander, or both. Amplitudes have the unit of the degree of freedom: radians, metres or m/s.
struct Oscillation {
  double rms = 0.0;  ///< of the part that waves drive
  double period_s = 8.0;
  double wander_rms = 0.0;  ///< of the slow part
  double wander_s = 60.0;   ///< correlation time of the slow part

  bool is_zero() const { return rms == 0.0 && wander_rms == 0.0; }
};

/// The vehicle's deviation from its track: a constant attitude and random movements.
struct MotionOptions {
  double roll_rad = 0.0, pitch_rad = 0.0;  ///< added to the track's roll and pitch
  double crab_rad = 0.0;  ///< heading minus course: positive if the bow points to starboard
  Oscillation roll, pitch, heading;  ///< radians
  Oscillation heave, sway, surge;    ///< metres: up, to starboard of the course, and ahead
  Oscillation speed;                 ///< m/s; only a generated track uses it
};

}  // namespace ensonify::engine
