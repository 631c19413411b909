#pragma once

#include <limits>
#include <optional>

#include <ensonify/scatter/sound_ray.h>

namespace ensonify::scatter {

/// From where to where a ray of sound is looked for.
struct EigenrayEnds {
  double source_depth_m = 0.0;
  double range_m = 0.0;  ///< horizontal, above 0
  double depth_m = 0.0;
  double surface_m = -std::numeric_limits<double>::infinity();
  double bottom_m = std::numeric_limits<double>::infinity();
};

/// The ray of sound between two points, at its source: the first to arrive of those that touch
/// neither surface nor bottom on the way; none where the point lies in a shadow zone. Found by
/// shooting at every tenth of a degree and at the angles at which rays graze a layer's edge, and
/// bisecting between those that pass above and below. The profile must outlive the ray. Throws
/// std::invalid_argument for ends that are not between surface and bottom, and a range that is not
/// above 0.
std::optional<SoundRay> find_eigenray(const SoundSpeedProfile& profile, const EigenrayEnds& ends);

}  // namespace ensonify::scatter
