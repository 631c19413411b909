#pragma once

#include <cmath>
#include <memory>
#include <utility>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::tests {

/// Where a fan begins and how it is turned.
struct SideLook {
  Eigen::Vector3d origin;
  double roll_rad = 0.0, pitch_rad = 0.0, yaw_rad = 0.0;
  bool port = false;
  double range_m = 50.0;
};

/// A fan that looks east, or west if `port`, before it is turned.
inline engine::RayFan fan_to_side(const SideLook& look,
                                  std::shared_ptr<const engine::FanGrid> grid) {
  using Eigen::Vector3d;
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(look.yaw_rad, Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(look.pitch_rad, Vector3d::UnitX()) *
                                Eigen::AngleAxisd(look.roll_rad, Vector3d::UnitY()))
                                   .toRotationMatrix();
  const double c = std::cos(grid->middle_depression_rad), s = std::sin(grid->middle_depression_rad);
  const double side = look.port ? -1.0 : 1.0;
  return {.grid = std::move(grid),
          .origin = look.origin,
          .array_axis = turn * Vector3d::UnitY(),
          .middle = turn * Vector3d(side * c, 0.0, -s),
          .pole = turn * Vector3d(side * s, 0.0, c),
          .range_m = look.range_m};
}

}  // namespace ensonify::tests
