#pragma once

#include <cstdint>
#include <limits>

#include <Eigen/Core>

namespace ensonify::engine {

/// Distances run from t_min to t_max along the direction, in units of the direction's length.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  double t_min = 0.0;
  double t_max = std::numeric_limits<double>::infinity();
};

/// The nearest face a ray meets, from either side. u and v are the weights of the face's second and
/// third corners: point = (1-u-v) a + u b + v c.
struct Hit {
  static constexpr std::uint32_t none = 0xffffffff;

  std::uint32_t face = none;   ///< its number
  std::uint32_t index = none;  ///< its index among the traced triangles
  double t = std::numeric_limits<double>::infinity();
  double u = 0.0;
  double v = 0.0;

  explicit operator bool() const { return face != none; }
};

}  // namespace ensonify::engine
