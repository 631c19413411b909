#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Geometry>

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

/// A grid of points on either side of a plate, row by row. The front's normal is the direction of
/// the rows' numbers times (cross product) that of the columns'; the back lies behind it.
struct PlateGrid {
  int rows = 0, columns = 0;
  std::vector<Eigen::Vector3d> front, back;
  std::vector<bool> cut;  ///< cells that are missing, (rows - 1) * (columns - 1); empty: none
};

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
  /// A frustum between two points.
  void taper(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double from_radius_m,
             double to_radius_m, int sides);
  /// A plate with the thickness between front and back, also round its holes. Of cells that touch
  /// at a corner alone, further ones are cut. Adds nothing if no cell is left.
  void plate(const PlateGrid& grid);

  /// What is added from now on belongs to this part.
  void begin_part(std::size_t number);
  /// The part of each face; empty if all belong to part 0.
  std::vector<std::uint8_t> face_parts();
  /// The number of vertices so far: what is added from now on begins there.
  std::size_t mark() const { return mesh.positions.size(); }
  /// Moves all vertices from a mark on.
  void move(std::size_t from, const Eigen::Isometry3d& motion);
  /// The box of all vertices from a mark on.
  Eigen::AlignedBox3d box(std::size_t from) const;

  refine::TriangleMesh mesh;
  std::vector<Eigen::Vector3d> exact;  ///< its positions before they were rounded and moved

 private:
  std::uint32_t add(const Eigen::Vector3d& point);

  std::vector<std::uint8_t> face_part_;
  std::uint8_t part_ = 0;
};

}  // namespace ensonify::engine
