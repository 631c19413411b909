#include <ensonify/engine/image/ping_rendering.h>

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace ensonify::engine {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d Camera::direction(const Vector2d& pixel) const {
  const Vector2d aside = (pixel - middle_px) / focal_px;
  return forward + aside.x() * right - aside.y() * up;
}

std::optional<Vector2d> Camera::project(const Vector3d& point) const {
  const Vector3d out = point - eye;
  const double depth = out.dot(forward);
  if (!(depth > 0.0)) return std::nullopt;
  return middle_px + focal_px / depth * Vector2d(out.dot(right), -out.dot(up));
}

Camera look_along(const Vector3d& forward, std::span<const Vector3d> points,
                  const Vector2d& size_px) {
  Camera camera{.forward = forward, .middle_px = 0.5 * size_px, .focal_px = 0.8 * size_px.x()};
  camera.right = forward.cross(Vector3d::UnitZ()).normalized();
  camera.up = camera.right.cross(forward);
  Vector3d aim = points.front();
  double distance = 0.0;
  for (const Vector3d& p : points) distance = std::max(distance, 4.0 * (p - aim).norm());
  for (int i = 0; i < 60; ++i) {
    camera.eye = aim - distance * forward;
    Vector2d low = Vector2d::Constant(1e9), high = -low;
    bool behind = false;
    for (const Vector3d& point : points) {
      const std::optional<Vector2d> pixel = camera.project(point);
      behind |= !pixel;
      low = low.cwiseMin(pixel.value_or(low));
      high = high.cwiseMax(pixel.value_or(high));
    }
    if (behind) {
      distance *= 1.5;
      continue;
    }
    const Vector2d filled = (high - low).cwiseQuotient(size_px).cwiseQuotient(Vector2d(0.9, 0.78));
    const Vector2d off = 0.5 * (low + high) - Vector2d(0.5, 0.52).cwiseProduct(size_px);
    aim += 0.5 * distance / camera.focal_px * (off.x() * camera.right - off.y() * camera.up);
    distance *= std::clamp(std::sqrt(filled.maxCoeff()), 0.7, 1.5);
  }
  return camera;
}

}  // namespace ensonify::engine
