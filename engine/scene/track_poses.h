#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/scene/tables/track_reader.h>
#include <ensonify/engine/seafloor/bed/geographic.h>

namespace ensonify::engine {

/// The seafloor under a track.
struct Ground {
  std::function<double(double x_m, double y_m)> bed_height_m;  ///< NaN where there is no bed
  Eigen::Vector2d lowest, highest;                             ///< of the seafloor, seen from above
  LocalFrame frame;
  std::function<void()> stop_check = {};  ///< called often; what it throws ends the work
};

/// One pose per ping of a scene.
struct TrackPoses {
  std::vector<Pose> poses;
  std::vector<std::size_t> leg_starts;  ///< as GeneratedPings; none of a recorded track
  /// The middle of the seabed on the earth: from the scene, or from a track in latitudes.
  std::optional<GeographicPlace> middle;
  std::vector<std::string> warnings;
};

/// Builds the scene's track over the ground: its path, then its height, then the vehicle's own
/// movements. Checks that each sonar lies over the seafloor, above the bed and below the sea
/// surface at every ping. Throws SceneError.
TrackPoses build_track(const Scene& scene, const Ground& ground, double sound_speed_mps);

}  // namespace ensonify::engine
