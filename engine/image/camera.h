#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

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

}  // namespace ensonify::engine
