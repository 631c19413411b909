#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// The artefacts that pings can have (Artefact, echo.h); none by default.
struct ArtefactOptions {
  double lost = 0.0;              ///< share of pings
  double repeated = 0.0;          ///< share of pings
  double stale_navigation = 0.0;  ///< share of the time in which the navigation repeats a report
  double stale_s = 3.0;           ///< length of such a time; several may follow each other
  // Another sonar: a pulse at one range, which moves from ping to ping if the two sonars are not
  // synchronised.
  std::optional<double> interference_db;  ///< above the noise; unset: none
  double interference_range_m = 0.0;      ///< in the first ping; 0: anywhere
  double interference_drift_m = 0.0;      ///< per ping; 0: fixed range
  double interference_length_m = 0.3;
  // Gain changes, by an operator and by the receiver.
  double gain_step_db = 0.0;      ///< rms of the steps about the gain
  double gain_step_s = 20.0;      ///< time between steps
  double automatic_gain = 0.0;    ///< share of a level change that this gain removes, 0..1
  double automatic_gain_m = 5.0;  ///< range over which it averages
  // In the water.
  double fish_per_hectare = 0.0;
  /// Target strength of one fish, dB re 1 m^2. The default is about the strength of a fish of 0.4 m
  /// from the side, from which the echo is strongest; a round figure, not measured.
  double fish_strength_db = -25.0;
  double fish_length_m = 0.4;
  double fish_height_m = 4.0;     ///< greatest height above the bed
  std::optional<double> wake_db;  ///< strength of a ship's wake at its middle, dB; unset: none
  double wake_heading_rad = 45.0 * degree;  ///< of the ship's track
  double wake_width_m = 6.0;
  double wake_offset_m = 0.0;  ///< distance of the track from the seabed's middle, to starboard
  // Shimmer by internal waves.
  double shimmer_db = 0.0;  ///< rms of the brightness changes
  double shimmer_m = 8.0;   ///< wavelength of the bands over range
  double shimmer_s = 6.0;   ///< their period
};

/// Whether a ping is lost, or repeats the ping before. The first ping does not repeat.
bool is_lost(const ArtefactOptions& options, std::uint64_t seed, std::uint64_t ping);
bool is_repeated(const ArtefactOptions& options, std::uint64_t seed, std::uint64_t ping);
/// The time at which the navigation became stale, if it is stale at t_s; otherwise t_s.
double reported_since_s(const ArtefactOptions& options, std::uint64_t seed, double t_s);
/// The ping whose report the navigation gives at a ping: an earlier ping if the navigation is
/// stale. `poses`: of all pings, ordered by time.
std::size_t reporting_ping(const ArtefactOptions& options, std::uint64_t seed,
                           std::span<const Pose> poses, std::size_t ping);

}  // namespace ensonify::engine
