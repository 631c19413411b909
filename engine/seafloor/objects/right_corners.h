#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/objects/flat_parts.h>

namespace ensonify::engine {

/// Two flat parts that meet in a right angle, and what lies between them. Sound that meets both
/// goes back to where it came from.
struct RightCorner {
  Eigen::Vector3d middle;      ///< of their common edge
  Eigen::Vector3f edge;        ///< unit, along it
  Eigen::Vector3f one, other;  ///< unit, from the edge along each flat part
  float length_m;              ///< of the edge
  float one_m, other_m;        ///< how far each flat part reaches from the edge
  float excess_rad;            ///< of the angle between them over a right one
  bool open;              ///< both normals point into the angle, so that it is outside the body
  std::uint32_t surface;  ///< another number than those of the object's flat parts
};

/// The right corners between flat parts, within a degree. None for curved surfaces. `stop_check` is
/// called now and then.
std::vector<RightCorner> right_corners(std::span<const FlatPart> flat_parts,
                                       const std::function<void()>& stop_check = {});

}  // namespace ensonify::engine
