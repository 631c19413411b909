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

/// At which range each launch angle from straight down to 60 degrees above the horizontal meets the
/// bed, rays that turn before the surface included. Neighbours differ by at most a 400th of the
/// range within it, and by a 50th up to four times as far; where a ray's range
/// jumps, or a ray meets the surface first, there is an entry that is not a number. Of a cast with
/// more than 2000 samples above the bed, means over a 2000th of the depth are followed: that is
/// enough to lay rays, which are then traced through the whole cast.
std::vector<LaunchRange> bent_ranges(const scatter::SoundSpeedProfile& cast, const BentWay& way);

}  // namespace ensonify::engine
