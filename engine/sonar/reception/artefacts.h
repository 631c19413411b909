#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// What spoils pings (Artefact, echo.h); nothing by default.
struct ArtefactOptions {
  double lost = 0.0;              ///< share of pings
  double repeated = 0.0;          ///< share of pings
  double stale_navigation = 0.0;  ///< share of the time in which the navigation stands still
  double stale_s = 3.0;           ///< how long it does each time
  // Another sonar: a burst at one range, which moves on from ping to ping if the two do not keep
  // time.
  std::optional<double> interference_db;  ///< above the noise; unset: none
  double interference_range_m = 0.0;      ///< in the first ping; 0: anywhere
  double interference_drift_m = 0.0;      ///< a ping; 0: fixed range
  double interference_length_m = 0.3;
  // The operator's hand, and the machine's.
  double gain_step_db = 0.0;      ///< rms of the steps about the gain
  double gain_step_s = 20.0;      ///< between them
  double automatic_gain = 0.0;    ///< share of a level's change that it takes away, 0..1
  double automatic_gain_m = 5.0;  ///< range over which it averages
  // In the water.
  double fish_per_hectare = 0.0;
  double fish_strength_db = -38.0;  ///< target strength of one, dB re 1 m^2
  double fish_length_m = 0.4;
  double fish_height_m = 4.0;     ///< they swim up to so high over the bed
  std::optional<double> wake_db;  ///< strength of a ship's wake at its middle, dB; unset: none
  double wake_heading_rad = 0.7853981633974483;  ///< 45 degrees, of the line that the ship left
  double wake_width_m = 6.0;
  double wake_offset_m = 0.0;  ///< of the line from the seabed's middle, to starboard
  double shimmer_db = 0.0;     ///< rms of the brightness
  double shimmer_m = 8.0;      ///< length of an internal wave's bands over range
  double shimmer_s = 6.0;      ///< and over time
};

/// Whether a ping is lost or repeats the one before; the first ping does not repeat.
bool is_lost(const ArtefactOptions& options, std::uint64_t seed, std::uint64_t ping);
bool is_repeated(const ArtefactOptions& options, std::uint64_t seed, std::uint64_t ping);
/// Since when the navigation has stood still at that time, if it does; else that time.
double reported_since_s(const ArtefactOptions& options, std::uint64_t seed, double t_s);
/// Repeats reports, ordered by time, while the navigation stands still; the first has none to
/// repeat.
void hold_stale(const ArtefactOptions& options, std::uint64_t seed, std::span<Pose> reports);

}  // namespace ensonify::engine
