#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Points in a plane across a way: x to its right, y up; counter-clockwise seen from behind, the
/// way running from the eye.
using CrossSection = std::vector<Eigen::Vector2d>;

/// A regular polygon of the circle's own area, so that a tube of it has the circle's volume.
CrossSection circle(double radius_m, int sides);
/// A rectangle about the way.
CrossSection rectangle(double width_m, double shape_height_m);

/// Collects closed surfaces that are turned outwards. Each call adds one; they may overlap. A mesh
/// made by these calls alone is manifold, without boundary.
class Solids {
 public:
  /// The surface through rings of as many points each, every one counter-clockwise about the way to
  /// the next; closed by a fan at both ends, or, for a loop, by joining the last ring to the first.
  void skin(std::span<const std::vector<Eigen::Vector3d>> rings, bool loop = false);
  /// A cross-section along points, with mitred corners. `up` is where its y points at the start; it
  /// is carried along without twist. A loop must lie in a plane.
  void sweep(std::span<const Eigen::Vector3d> points, const CrossSection& section,
             const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), bool loop = false);
  /// A profile of (radius, height), every radius positive, turned about z; heights rise from the
  /// first to the last, or the profile is a loop, counter-clockwise in that plane.
  void revolve(std::span<const Eigen::Vector2d> profile, int segments, bool loop = false);
  /// A ball of 20 * 4^level faces.
  void ball(const Eigen::Vector3d& middle, double radius_m, int level);
  /// A block about a middle, its edges along the axes.
  void block(const Eigen::Vector3d& middle, const Eigen::Vector3d& size_m);

  refine::TriangleMesh mesh;

 private:
  std::uint32_t add(const Eigen::Vector3d& point);
};

}  // namespace ensonify::engine
