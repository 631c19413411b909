#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include <Eigen/Core>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// A flat part of a body's surface: faces that join in one plane. It is described as the rectangle
/// that has their area and second moments, or as the ellipse that has their area and the
/// rectangle's ratio of sides. Where the surface is curved, its facets are such parts. One with a
/// hole or a bay, for which no rectangle can stand, is cut into pieces that are such parts.
struct FlatPart {
  Eigen::Vector3d middle;
  Eigen::Vector3f normal;         ///< unit, out of the body
  Eigen::Vector3f along, across;  ///< unit, its principal axes
  float length_m, width_m;        ///< along them; their product is the area
  /// Of a curved surface: twice the standard deviation of the normals, in these directions, at the
  /// places where it meets its neighbours. In a grid of rectangles that is the angle between
  /// neighbours. 0 where the surface is flat, ends or has a real edge.
  float bend_along_rad, bend_across_rad;
  /// The arc of the curved surface over which its normal turns by the bend, m: negative where the
  /// surface is concave, 0 where it has no bend.
  float arc_along_m, arc_across_m;
  bool round;             ///< nearer to an ellipse than to a rectangle
  bool piece;             ///< of a flat part that was cut; the others have the same `surface`
  std::uint32_t surface;  ///< parts that join without a real edge have the same number
};

/// The flat parts of a body, and the pieces of those that were cut.
struct FlatParts {
  std::vector<FlatPart> whole;
  std::map<std::size_t, std::vector<FlatPart>> pieces;  ///< by the number in `whole`

  /// All in their order, with the pieces of a flat part in its place.
  std::vector<FlatPart> in_pieces() &&;
};

/// The flat parts of a mesh. Vertices at one place count as one. Edges sharper than 40 degrees are
/// real ones, as in facet_angle_rad(). `stop_check` is called now and then.
FlatParts flat_parts_of(refine::Triangles triangles, const std::function<void()>& stop_check = {});

}  // namespace ensonify::engine
