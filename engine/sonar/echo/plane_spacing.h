#pragma once

#include <optional>
#include <span>
#include <string>

#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// The azimuth between neighbouring planes of a fan about the beam's axis.
double planes_apart_rad(const Sonar& sonar, double wavelength_m);

/// A warning about features of the bed that are shorter along the track than the distance between
/// two planes of a fan, where the track passes nearest: a ping may miss such a feature, or count it
/// for a whole plane. It names the feature that is shortest in relation to that distance, and the
/// number of the others. None if there is no such feature. (Objects need no planes: ObjectEchoes.)
std::optional<std::string> coarse_planes_warning(std::span<const Sonar> sonars,
                                                 double sound_speed_mps, const Seafloor& seafloor,
                                                 std::span<const Pose> poses);

}  // namespace ensonify::engine
