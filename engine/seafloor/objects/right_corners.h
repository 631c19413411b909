#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/objects/flat_parts.h>

namespace ensonify::engine {

/// Two flat parts that meet at a right angle. Sound that both parts reflect returns to its source.
struct RightCorner {
  Eigen::Vector3d middle;      ///< middle of the common edge
  Eigen::Vector3f edge;        ///< unit, along the edge
  Eigen::Vector3f one, other;  ///< unit, from the edge along each flat part
  float length_m;              ///< of the edge
  float one_m, other_m;        ///< length of each flat part from the edge
  float excess_rad;            ///< angle between the flat parts minus a right angle
  bool open;              ///< both normals point into the angle, which is then outside the body
  std::uint32_t surface;  ///< a number that no flat part of the object has
};

/// The corners between flat parts that are perpendicular within a degree. Curved surfaces have no
/// corners. `stop_check` is called from time to time.
std::vector<RightCorner> right_corners(std::span<const FlatPart> flat_parts,
                                       const std::function<void()>& stop_check = {});

}  // namespace ensonify::engine
