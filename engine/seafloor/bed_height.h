#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/footprint.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

// The classes give the height of the bed at a place: the height of the topmost bed face there, in
// local metres, without objects. The height is NaN over a hole and outside the seafloor. It depends
// on the mesh alone, not on the intersector, and both classes return the same bits.

/// A point on the topmost face of the bed at a place.
struct BedPoint {
  double height_m;
  std::uint32_t face;  ///< number of the face
};

/// Finds the face with a horizontal grid over the bed's faces: the bed's grid of heights, or, for a
/// mesh, a grid that this class makes. Thread-safe.
class BedGrid {
 public:
  static constexpr double bytes_per_face = 24.0;  ///< least memory of the grid over a mesh
  /// The seafloor must have a grid or a mesh and outlive this object. `stop_check` is called from
  /// time to time while a grid is made, and may throw to end the work.
  explicit BedGrid(const Seafloor& seafloor, const std::function<void()>& stop_check = {});

  double height_m(double x_m, double y_m) const;
  /// None over a hole and outside the seafloor.
  std::optional<BedPoint> top(double x_m, double y_m) const;

  /// The positions of the bed's vertices whose x and y are inside the box, each vertex once.
  std::vector<Eigen::Vector3f> vertices_within(const refine::Bounds& box) const;
  /// The bed's bounding box.
  refine::Bounds bounds() const;

 private:
  using Cells = Eigen::Array<std::int64_t, 2, 1>;
  Cells cell_of(const Eigen::Vector2d& place) const;
  /// The lowest and the highest column and row that the face can touch.
  std::array<Cells, 2> cells_of(std::uint32_t face) const;
  /// Calls f(cell) for each cell in the columns and rows from ends[0] to ends[1].
  template <class F>
  void for_each_cell(const std::array<Cells, 2>& ends, F&& f) const;

  void make_cells(const std::function<void()>& stop_check);
  std::optional<BedPoint> top_in_grid(double x_m, double y_m) const;
  std::vector<Eigen::Vector3f> grid_vertices_within(const refine::Bounds& box) const;

  std::shared_ptr<const refine::HeightGrid> heights_;
  // For a bed without heights_, the grid over its mesh:
  refine::Triangles bed_;
  Eigen::Vector2d lowest_;
  double cell_m_ = 1.0;
  Cells cells_ = Cells::Zero();
  std::vector<std::uint64_t> first_;  // index of a cell's first face in faces_; one more at the end
  std::vector<std::uint32_t> faces_;
};

/// Finds the face among the faces of a progressive mesh that a plumb line touches. Not thread-safe.
class PlumbLine {
 public:
  /// The seafloor must have a progressive mesh, which this object shares.
  explicit PlumbLine(const Seafloor& seafloor);

  double height_m(double x_m, double y_m);
  std::optional<BedPoint> top(double x_m, double y_m);

 private:
  std::shared_ptr<const refine::ProgressiveMesh> mesh_;
  std::size_t bed_faces_;
  double highest_m_, lowest_m_;
  refine::Footprint footprint_;
};

}  // namespace ensonify::engine
