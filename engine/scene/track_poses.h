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

/// The seafloor below a track.
struct Ground {
  std::function<double(double x_m, double y_m)> bed_height_m;  ///< NaN where there is no bed
  Eigen::Vector2d lowest, highest;  ///< bounds of the seafloor, seen from above
  LocalFrame frame;
  std::function<void()> stop_check = {};  ///< called often; may throw to end the work
};

/// One pose per ping of a scene.
struct TrackPoses {
  std::vector<Pose> poses;
  std::vector<std::size_t> leg_starts;  ///< as in GeneratedPings; empty for a recorded track
  /// Where the middle of the seabed lies on Earth: from the scene, or from a track in latitudes.
  std::optional<GeographicPlace> middle;
  std::vector<std::string> warnings;
};

/// Builds the scene's track over the ground: first its path, then its height, then the vehicle's
/// random movements. Checks that at every ping the vehicle and each sonar are over the seafloor,
/// above the bed and below the sea surface. Throws SceneError.
TrackPoses build_track(const Scene& scene, const Ground& ground, double sound_speed_mps);

}  // namespace ensonify::engine
