#pragma once

#include <limits>
#include <optional>

#include <ensonify/scatter/sound_ray.h>

namespace ensonify::scatter {

/// The two ends of a ray of sound, and the depths of surface and bottom.
struct EigenrayEnds {
  double source_depth_m = 0.0;
  double range_m = 0.0;  ///< horizontal, above 0
  double depth_m = 0.0;
  double surface_m = -std::numeric_limits<double>::infinity();
  double bottom_m = std::numeric_limits<double>::infinity();
};

/// Finds the ray of sound between two points and returns it at its source. Of the rays that touch
/// neither surface nor bottom on the way, it is the first to arrive. Returns nullopt if there is no
/// such ray, because the point is in a shadow zone. Rays are tried at every tenth of a degree and
/// at the angles at which rays graze a layer's edge. Between a ray that passes above the point and
/// one that passes below, the ray is found by bisection. The profile must outlive the ray. Throws
/// std::invalid_argument for ends that are not between surface and bottom, and for a range that is
/// not above 0.
std::optional<SoundRay> find_eigenray(const SoundSpeedProfile& profile, const EigenrayEnds& ends);

/// A ray of sound at the point where it arrives, with the direction of its launch, `along` and
/// `down` as in SoundRayPoint.
struct ArrivedRay {
  double along, down;
  SoundRay ray;
};

/// The ray next to the straight line between two points, by Newton's steps that start with this
/// line. It takes microseconds, where find_eigenray() takes milliseconds. None if the steps do not
/// converge, as in a shadow zone. The range may be 0; all else is as for find_eigenray().
std::optional<ArrivedRay> find_near_eigenray(const SoundSpeedProfile& profile,
                                             const EigenrayEnds& ends);

}  // namespace ensonify::scatter
