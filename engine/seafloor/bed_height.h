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

// The classes give the height of the bed at a place: of the topmost bed face there, in local
// metres, without objects; NaN over a hole and outside the seafloor. The height depends on the mesh
// alone, not on the intersector, and all return the same bits.

/// A point of the bed, on the topmost of its faces there.
struct BedPoint {
  double height_m;
  std::uint32_t face;  ///< the number
};

/// Finds the face with a grid over the bed's faces, seen from above: that of its heights, or one
/// that is made over a mesh. Thread-safe.
class BedGrid {
 public:
  static constexpr double bytes_per_face = 24.0;  ///< memory that it needs over a mesh, at least
  /// The seafloor must have a grid or a mesh and outlive this object. `stop_check` is called now
  /// and then while a grid is made; what it throws ends that.
  explicit BedGrid(const Seafloor& seafloor, const std::function<void()>& stop_check = {});

  double height_m(double x_m, double y_m) const;
  /// None over a hole and outside the seafloor.
  std::optional<BedPoint> top(double x_m, double y_m) const;

  /// The positions of the bed's vertices inside a box seen from above, each vertex once.
  std::vector<Eigen::Vector3f> vertices_within(const refine::Bounds& box) const;
  /// The bed's bounding box.
  refine::Bounds bounds() const;

 private:
  using Cells = Eigen::Array<std::int64_t, 2, 1>;
  Cells cell_of(const Eigen::Vector2d& place) const;
  /// The lowest and the highest column and row that the face can touch.
  std::array<Cells, 2> cells_of(std::uint32_t face) const;
  /// Calls f(cell) for each of these cells.
  template <class F>
  void for_each_cell(std::uint32_t face, F&& f) const;

  void make_cells(const std::function<void()>& stop_check);
  std::optional<BedPoint> top_in_grid(double x_m, double y_m) const;
  std::vector<Eigen::Vector3f> grid_vertices_within(const refine::Bounds& box) const;

  std::shared_ptr<const refine::HeightGrid> heights_;
  // Without those:
  refine::Triangles bed_;
  Eigen::Vector2d lowest_;
  double cell_m_ = 1.0;
  Cells cells_ = Cells::Zero();
  std::vector<std::uint64_t> first_;  // index of a cell's first face in faces_; one more at the end
  std::vector<std::uint32_t> faces_;
};

/// Finds the face among those of a progressive mesh that a vertical line can touch. One thread at a
/// time.
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
