#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Points in a plane perpendicular to a direction. For a viewer who looks along the direction, x is
/// to the right, y is up and the points are counter-clockwise.
using CrossSection = std::vector<Eigen::Vector2d>;

/// A regular polygon with the area of the circle, so a tube with this section has the right volume.
CrossSection circle(double radius_m, int sides);
/// A rectangle about the origin.
CrossSection rectangle(double width_m, double shape_height_m);

/// Grids of points on the front and the back of a plate, row by row. The normal of the front is the
/// cross product of the direction of increasing rows and the direction of increasing columns.
struct PlateGrid {
  int rows = 0, columns = 0;
  std::vector<Eigen::Vector3d> front, back;
  std::vector<bool> cut;  ///< whether a cell is missing, (rows - 1) * (columns - 1); empty: none

  /// Adds a point to the front, and to the back the point thick_m below it.
  void add(const Eigen::Vector3d& point, double thick_m) {
    front.push_back(point);
    back.emplace_back(point - Eigen::Vector3d(0.0, 0.0, thick_m));
  }
};

/// Collects closed surfaces with normals outwards. Each call adds one surface; surfaces may
/// overlap. A mesh made only by these calls is manifold and has no boundary.
class Solids {
 public:
  /// The surface through rings with equal numbers of points. The points of each ring are
  /// counter-clockwise about the direction to the next ring. A triangle fan closes each end; a loop
  /// is closed by joining the last ring to the first.
  void skin(std::span<const std::vector<Eigen::Vector3d>> rings, bool loop = false);
  /// A cross-section swept along points without twist, with mitred corners. At the start the y of
  /// the section points to `up`. A loop must be in a plane.
  void sweep(std::span<const Eigen::Vector3d> points, const CrossSection& section,
             const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), bool loop = false);
  /// A profile of points (radius, height), rotated about z. All radii are positive. Heights rise
  /// from the first to the last, or the profile is a loop, counter-clockwise in (radius, height).
  void revolve(std::span<const Eigen::Vector2d> profile, int segments, bool loop = false);
  /// A ball of 20 * 4^level faces.
  void ball(const Eigen::Vector3d& middle, double radius_m, int level);
  /// A block with its edges along the axes.
  void block(const Eigen::Vector3d& middle, const Eigen::Vector3d& size_m);
  /// A frustum between two points.
  void taper(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double from_radius_m,
             double to_radius_m, int sides);
  /// A plate between front and back, with walls around it and around its holes. If two cells touch
  /// only at a corner, one of them is cut too. Adds nothing if no cell is left.
  void plate(const PlateGrid& grid);

  /// Faces that are added after this call belong to this part. Returns mark().
  std::size_t begin_part(std::size_t number);
  /// The part of each face; empty if all belong to part 0.
  std::vector<std::uint8_t> face_parts();
  /// The number of vertices so far, which marks where later surfaces begin.
  std::size_t mark() const { return mesh.positions.size(); }
  /// Moves all vertices that were added after a mark.
  void move(std::size_t from, const Eigen::Isometry3d& motion);
  /// The box around all vertices that were added after a mark.
  Eigen::AlignedBox3d box(std::size_t from) const;

  refine::TriangleMesh mesh;
  std::vector<Eigen::Vector3d> exact;  ///< positions of `mesh` before they were rounded and moved

 private:
  std::uint32_t add(const Eigen::Vector3d& point);

  std::vector<std::uint8_t> face_part_;
  std::uint8_t part_ = 0;
};

}  // namespace ensonify::engine
