#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>

#include <Eigen/Core>

#include <ensonify/engine/image/display.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/vehicle/track.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/active_mesh.h>

namespace ensonify::engine {

/// A pinhole camera. Pixels are counted from the picture's upper left corner.
struct Camera {
  Eigen::Vector3d eye;                 ///< local metres
  Eigen::Vector3d right, up, forward;  ///< unit
  Eigen::Vector2d middle_px;
  double focal_px;

  /// The viewing direction of a pixel. Its component along `forward` is 1.
  Eigen::Vector3d direction(const Eigen::Vector2d& pixel) const;
  /// The pixel that shows a point; none if the point is behind the camera.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point) const;
};

/// A camera that looks along `forward` and sees all points. The points fill a picture of `size_px`
/// (columns, rows) except for a margin.
Camera look_along(const Eigen::Vector3d& forward, std::span<const Eigen::Vector3d> points,
                  const Eigen::Vector2d& size_px);

/// One ping over a seafloor. All places are in the seafloor's local metres.
struct ViewSubject {
  const Seafloor& seafloor;
  const refine::ActiveMesh& mesh;  ///< of the seafloor, refined for the fans
  std::span<const RayFan> fans;
  std::span<const Pose> track;
  std::size_t ping;  ///< index into the track
};

struct ViewOptions {
  std::size_t width_px = 1600;
  std::size_t height_px = 1000;
  int threads = 1;
  /// Called with the number of finished rows, by one thread at a time; if it throws, the work ends.
  std::function<void(std::size_t done, std::size_t of)> progress;
};

struct PingRendering {
  Picture picture;
  Camera camera;
};

/// A perspective picture of one ping (as fig. 5 of the paper), without vertical exaggeration. It
/// shows the active mesh with its edges, with separate colours for exact faces and for objects; the
/// middle plane of each fan as a transparent sheet that ends at the bed, with rings of equal range;
/// the track; the sonar, enlarged, and a vertical line from it to the bed. The camera is behind the
/// sonar, to starboard and above, and sees the whole fans. The picture does not depend on the
/// number of threads. Throws std::invalid_argument for a picture without pixels, for no fans and
/// for a ping that does not exist, and what the tracer throws.
PingRendering shade(const ViewSubject& subject, const ViewOptions& options);

}  // namespace ensonify::engine
