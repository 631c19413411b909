#pragma once

#include <Eigen/Core>

namespace ensonify::engine {

/// The horizontal direction of a vector, unit; x where it is vertical.
inline Eigen::Vector2d horizontal(const Eigen::Vector3d& direction) {
  const Eigen::Vector2d level = direction.head<2>();
  const double length = level.norm();
  return length > 0.0 ? Eigen::Vector2d(level / length) : Eigen::Vector2d::UnitX();
}

}  // namespace ensonify::engine
