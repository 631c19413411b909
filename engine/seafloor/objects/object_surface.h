#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/engine/seafloor/object_mesh.h>
#include <ensonify/engine/seafloor/objects/flat_parts.h>
#include <ensonify/engine/seafloor/objects/right_corners.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {

/// Some neighbouring flat parts of a body: where they lie and in which directions they face.
struct FlatPartBlock {
  std::size_t first, count;  ///< these of the body's flat parts
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double radius_m = 0.0;  ///< of a ball about the middle that contains them and their surface
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  ///< unit, the mean of their normals
  double cone_rad = 0.0;  ///< no normal, of them or of their surface, is further from the axis
  /// Length in a direction in which a flat part or its surface is straight; infinity if there is
  /// none.
  double shortest_straight_m = std::numeric_limits<double>::infinity();

  FlatPartBlock(std::span<const FlatPart> flat_parts, const CurvedFacets& curved,
                std::size_t its_first, std::size_t its_count);
  /// Whether a flat part may have a place whose normal (for a two-sided part also its opposite) is
  /// within the angle with the sine `reach` of the direction to `from`. False is certain; true is
  /// not.
  bool may_face(const Eigen::Vector3d& from, double reach, bool two_sided) const;
};

/// The flat parts of an object, or of those of its parts that have one label.
struct ObjectSurface {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double radius_m = 0.0;    ///< of a ball about the middle that contains it
  std::uint16_t label = 0;  ///< as in FaceLabels
  std::vector<FlatPart> flat_parts;
  CurvedFacets curved;
  std::vector<FlatPartBlock> blocks;  ///< of the flat parts, in their order
  std::vector<RightCorner> corners;   ///< of the flat parts

  ObjectSurface() = default;
  /// Everything is found in the mesh's own frame, and then moved to its place.
  ObjectSurface(const ObjectMesh& mesh, std::uint16_t its_label,
                const std::function<void()>& stop_check = {});
  /// Makes `there` a copy of this surface, moved to a place. Allocates nothing if `there` had as
  /// many flat parts.
  void place_at(const Eigen::Isometry3d& place, ObjectSurface& there) const;

 private:
  void move(const Eigen::Isometry3d& motion);
};

/// The distance from a place to the nearest flat part of these objects; at most farthest_m.
double nearest_flat_part_m(std::span<const ObjectSurface> objects, const Eigen::Vector3d& from,
                           double farthest_m);

/// The objects of a seafloor, in the order of their labels. The same with any number of threads,
/// each of which calls `stop_check` now and then.
std::vector<ObjectSurface> object_surfaces(const Seafloor& seafloor, int threads,
                                           const std::function<void()>& stop_check);

}  // namespace ensonify::engine
