#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/engine/seafloor/seafloor.h>
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
  /// The angle to the normals of the neighbours in these directions; 0 where the surface ends or
  /// has a real edge.
  float bend_along_rad, bend_across_rad;
  bool round;             ///< nearer to an ellipse than to a rectangle
  bool piece;             ///< of a flat part that was cut; the others have the same `surface`
  std::uint32_t surface;  ///< parts that join without a real edge have the same number
};

/// The flat parts of a mesh. Vertices at one place count as one. Edges sharper than 40 degrees are
/// real ones, as in facet_angle_rad(). `stop_check` is called now and then.
std::vector<FlatPart> flat_parts_of(refine::Triangles triangles,
                                    const std::function<void()>& stop_check = {});

/// Some neighbouring flat parts of a body: where they lie and in which directions they face.
struct FlatPartBlock {
  std::size_t first, count;  ///< these of the body's flat parts
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double radius_m = 0.0;  ///< of a ball about the middle that contains the flat parts
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  ///< unit, the mean of their normals
  double cone_rad = 0.0;                           ///< no normal is further from the axis
  double max_bend_rad = 0.0;                       ///< of a flat part, both directions together
  /// Length in a direction without a bend; infinity if there is none.
  double shortest_plane_m = std::numeric_limits<double>::infinity();

  FlatPartBlock(std::span<const FlatPart> flat_parts, std::size_t its_first, std::size_t its_count);
  /// Whether a flat part may have a place whose normal (for a two-sided part also its opposite) is
  /// within the angle with the sine `reach` of the direction to `from`. False is certain; true is
  /// not.
  bool may_face(const Eigen::Vector3d& from, double reach, bool two_sided) const;
};

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

/// The flat parts of an object, or of those of its parts that have one label.
struct ObjectSurface {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double radius_m = 0.0;    ///< of a ball about the middle that contains it
  std::uint16_t label = 0;  ///< as in FaceLabels
  std::vector<FlatPart> flat_parts;
  std::vector<FlatPartBlock> blocks;  ///< of the flat parts, in their order
  std::vector<RightCorner> corners;   ///< of the flat parts

  ObjectSurface() = default;
  ObjectSurface(refine::Triangles triangles, std::uint16_t its_label,
                const std::function<void()>& stop_check = {});
  /// Makes `there` a copy of this surface, moved to a place. Allocates nothing if `there` had as
  /// many flat parts.
  void place_at(const Eigen::Isometry3d& place, ObjectSurface& there) const;
};

/// The distance from a place to the nearest flat part of these objects; at most farthest_m.
double nearest_flat_part_m(std::span<const ObjectSurface> objects, const Eigen::Vector3d& from,
                           double farthest_m);

/// The objects of a seafloor, in the order of their labels. The same for a mesh and for its
/// progressive mesh and with any number of threads, each of which calls `stop_check` now and then.
std::vector<ObjectSurface> object_surfaces(const Seafloor& seafloor, int threads,
                                           const std::function<void()>& stop_check);

}  // namespace ensonify::engine
