#pragma once

#include <optional>
#include <span>
#include <string>

#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/instrument/sonar.h>
#include <ensonify/engine/sonar/vehicle/track.h>

namespace ensonify::engine {

/// What should be said of a track's objects, pits and boulders that are shorter along the track
/// than a fan's planes are apart where they pass nearest: a ping may miss such a thing, or count it
/// for a whole plane. One sentence of the one that is shortest against it, and how many more there
/// are; none if none is.
std::optional<std::string> coarse_planes_warning(std::span<const Sonar> sonars,
                                                 double sound_speed_mps, const Seafloor& seafloor,
                                                 std::span<const Pose> poses);

}  // namespace ensonify::engine
