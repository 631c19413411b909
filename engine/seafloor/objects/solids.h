#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Points in the plane across a direction, x to its right and y up, counter-clockwise for a viewer
/// who looks along the direction.
using CrossSection = std::vector<Eigen::Vector2d>;

/// A regular polygon with the area of the circle, so that a tube with this section has the right
/// volume.
CrossSection circle(double radius_m, int sides);
/// A rectangle, centred on the direction.
CrossSection rectangle(double width_m, double shape_height_m);

/// Collects closed surfaces with normals outwards. Each call adds one; they may overlap. A mesh
/// made only by these calls is manifold and has no boundary.
class Solids {
 public:
  /// The surface through rings with the same number of points, each counter-clockwise about the
  /// direction to the next ring; closed by a triangle fan at both ends or, for a loop, by joining
  /// the last ring to the first.
  void skin(std::span<const std::vector<Eigen::Vector3d>> rings, bool loop = false);
  /// A cross-section swept along points, with mitred corners. At the start its y points to `up`;
  /// it is carried along without twist. A loop must lie in a plane.
  void sweep(std::span<const Eigen::Vector3d> points, const CrossSection& section,
             const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), bool loop = false);
  /// A profile of (radius, height), rotated about z. All radii are positive; heights rise from
  /// the first to the last, or the profile is a loop, counter-clockwise in that plane.
  void revolve(std::span<const Eigen::Vector2d> profile, int segments, bool loop = false);
  /// A ball of 20 * 4^level faces.
  void ball(const Eigen::Vector3d& middle, double radius_m, int level);
  /// A block with its edges along the axes.
  void block(const Eigen::Vector3d& middle, const Eigen::Vector3d& size_m);

  refine::TriangleMesh mesh;

 private:
  std::uint32_t add(const Eigen::Vector3d& point);
};

}  // namespace ensonify::engine
