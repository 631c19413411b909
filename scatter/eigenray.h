#pragma once

#include <limits>
#include <optional>

#include <ensonify/scatter/sound_ray.h>

namespace ensonify::scatter {

/// The two ends of a ray of sound, and the boundaries.
struct EigenrayEnds {
  double source_depth_m = 0.0;
  double range_m = 0.0;  ///< horizontal, above 0
  double depth_m = 0.0;
  double surface_m = -std::numeric_limits<double>::infinity();
  double bottom_m = std::numeric_limits<double>::infinity();
};

/// The ray of sound between two points, at its source: the first to arrive of those that touch
/// neither surface nor bottom on the way; none if the point is in a shadow zone. Found by shooting
/// at every tenth of a degree and at the angles at which rays graze a layer's edge, and by
/// bisection between rays that pass above and below. The profile must outlive the ray. Throws
/// std::invalid_argument for ends that are not between surface and bottom, and for a range that is
/// not above 0.
std::optional<SoundRay> find_eigenray(const SoundSpeedProfile& profile, const EigenrayEnds& ends);

/// A ray of sound at the point where it arrives, with the sine and cosine of its launch, as in
/// SoundRayPoint.
struct ArrivedRay {
  double along, down;
  SoundRay ray;
};

/// The ray next to the straight line between two points, by Newton's steps from that line: in some
/// microseconds, where find_eigenray() takes milliseconds. None where the steps do not end, as in a
/// shadow zone. The range may be 0; otherwise as find_eigenray().
std::optional<ArrivedRay> find_near_eigenray(const SoundSpeedProfile& profile,
                                             const EigenrayEnds& ends);

}  // namespace ensonify::scatter
