#pragma once

#include <vector>

#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// The water column over a level bed that rays of sound are followed through.
struct BentWay {
  double source_depth_m;  ///< of the sonar, not negative
  double height_m;        ///< of the sonar over the bed, above 0
  double reference_mps;   ///< ranges are travel times at this speed
  double range_m;         ///< the ranges that are needed
};

/// The launch angles between which bent rays do not reach a level bed. Just outside them a ray's
/// range changes by metres per millionth of a radian.
struct LaunchLimits {
  /// Within this angle of the level, up or down, a ray turns in faster water above the bed.
  double grazing_rad;
  /// Rays that start upwards more steeply reach the surface; at least grazing_rad.
  double surface_rad;
};

/// The limits over a bed that is below the source; both depths are not negative.
LaunchLimits launch_limits(const scatter::SoundSpeedProfile& profile, double source_depth_m,
                           double bed_depth_m);

/// Where rays meet a level bed, by launch angle, and between which angles they do not.
struct BentRanges {
  std::vector<LaunchRange> by_launch;
  LaunchLimits limits;
};

/// At which range each launch angle from straight down to 60 degrees above the horizontal meets the
/// bed, rays that turn before the surface included. The ranges of neighbouring entries differ by at
/// most a 400th of way.range_m. Beyond way.range_m, up to four times as far, they differ by at most
/// a 50th of it. Where a ray's range jumps, or a ray meets the surface first, there is an entry
/// that is not a number. If a cast has more than 2000 samples above the bed, the rays follow means
/// over a 2000th of the depth. This is enough to lay rays, which are then traced through the whole
/// cast. The limits are those of the profile that the rays follow.
BentRanges bent_ranges(const scatter::SoundSpeedProfile& cast, const BentWay& way);

/// Bounds on how far the bent rays of a fan leave their straight lines. They hold for faces no
/// deeper than deepest_m, and for rays whose travel time times reference_mps is at most range_m.
FanBend bend_of(const scatter::SoundSpeedProfile& profile, double deepest_m, double range_m,
                double reference_mps);

}  // namespace ensonify::engine
