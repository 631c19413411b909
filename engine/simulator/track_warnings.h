#pragma once

#include <optional>
#include <span>
#include <string>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/simulate.h>

namespace ensonify::engine {

/// A warning about features of the bed that are shorter along the track than the distance between
/// two planes of a fan, where the track passes nearest: a ping may miss such a feature, or count it
/// for a whole plane. It names the feature that is shortest in relation to that distance, and the
/// number of other features. None if there is no such feature. (Objects need no planes:
/// ObjectEchoes.)
std::optional<std::string> coarse_planes_warning(std::span<const Sonar> sonars,
                                                 double sound_speed_mps, const Seafloor& seafloor,
                                                 std::span<const Pose> poses);

/// A warning about bins that are beyond the edge of the bed, where the picture is as black as in a
/// shadow. It names the sonar with the largest share of such bins, the share, the pings and what to
/// do. The bed is taken as level. None for a share of up to 1 %.
std::optional<std::string> beyond_bed_warning(std::span<const Sonar> sonars,
                                              const SeafloorOptions& options,
                                              const Seafloor& seafloor,
                                              std::span<const Pose> poses);

/// A warning about the first sonar whose range ends above the bed in all pings. None if there is no
/// such sonar, or no bed below the track.
std::optional<std::string> short_range_warning(const Simulator& simulator,
                                               std::span<const Pose> poses);

}  // namespace ensonify::engine
