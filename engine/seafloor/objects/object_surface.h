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

/// Some neighbouring flat parts of a body, with bounds of their places and normals.
struct FlatPartBlock {
  std::size_t first, count;  ///< range in the body's flat parts
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double radius_m = 0.0;  ///< of a ball about the middle around the parts and their curved surface
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  ///< unit, mean of the parts' normals
  double cone_rad = 0.0;  ///< greatest angle between the axis and a normal of part or surface
  /// Shortest length in a direction in which a flat part or its curved surface is straight;
  /// infinity if there is none.
  double shortest_straight_m = std::numeric_limits<double>::infinity();

  FlatPartBlock(std::span<const FlatPart> flat_parts, const CurvedFacets& curved,
                std::size_t its_first, std::size_t its_count);
  /// Whether the normal at a place of a flat part may differ from the direction to `from` by at
  /// most the angle with the sine `reach`. A two-sided part also has the opposite normal. False is
  /// certain; true is not.
  bool may_face(const Eigen::Vector3d& from, double reach, bool two_sided) const;
};

/// The flat parts of an object, or of the parts of an object that have one label.
struct ObjectSurface {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double radius_m = 0.0;    ///< of a ball about the middle that contains the object
  std::uint16_t label = 0;  ///< as in FaceLabels
  std::vector<FlatPart> flat_parts;
  CurvedFacets curved;
  std::vector<FlatPartBlock> blocks;  ///< blocks of the flat parts, in their order
  std::vector<RightCorner> corners;   ///< corners of the flat parts

  ObjectSurface() = default;
  /// Finds everything in the mesh's own frame, and then moves it to the mesh's place.
  ObjectSurface(const ObjectMesh& mesh, std::uint16_t its_label,
                const std::function<void()>& stop_check = {});
  /// Makes `there` a copy of this surface, moved to a place. Allocates nothing if `there` was such
  /// a copy before.
  void place_at(const Eigen::Isometry3d& place, ObjectSurface& there) const;

 private:
  void move(const Eigen::Isometry3d& motion);
};

/// The distance from a place to the nearest flat part of the objects, but at most farthest_m.
double nearest_flat_part_m(std::span<const ObjectSurface> objects, const Eigen::Vector3d& from,
                           double farthest_m);

/// The objects of a seafloor, in the order of their labels. The result does not depend on the
/// number of threads. Each thread calls `stop_check` from time to time.
std::vector<ObjectSurface> object_surfaces(const Seafloor& seafloor, int threads,
                                           const std::function<void()>& stop_check);

}  // namespace ensonify::engine
