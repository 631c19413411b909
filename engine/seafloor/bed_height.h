#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/footprint.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// How high the bed is at a place: the topmost bed face there, local metres, objects left out; NaN
/// over a hole and off the seafloor. The answer depends on the mesh alone, whatever traces the
/// pings, and is the same to the bit from either of the two.

/// By a grid over the bed's faces as seen from above. Any number of threads may ask.
class BedGrid {
 public:
  static constexpr double bytes_per_face = 24.0;  ///< that it takes of memory at least
  /// Of a seafloor with a mesh, which must outlive this.
  explicit BedGrid(const Seafloor& seafloor);

  double height_m(double x_m, double y_m) const;

  /// The places of the bed's vertices that lie within a box as seen from above, each once.
  std::vector<Eigen::Vector3f> vertices_within(const refine::Bounds& box) const;
  /// The box around the bed.
  refine::Bounds bounds() const { return refine::bounds(bed_); }

 private:
  using Cells = Eigen::Array<std::int64_t, 2, 1>;
  Cells cell_of(const Eigen::Vector2d& place) const;
  /// The first and the last column and row that the face's outline can meet.
  std::array<Cells, 2> cells_of(std::uint32_t face) const;
  /// Calls f(cell) for each of these cells.
  template <class F>
  void for_each_cell(std::uint32_t face, F&& f) const;

  refine::Triangles bed_;
  Eigen::Vector2d lowest_;
  double cell_m_ = 1.0;
  Cells cells_ = Cells::Zero();
  std::vector<std::uint64_t> first_;  // of a cell's faces; one more at the end
  std::vector<std::uint32_t> faces_;
};

/// By the faces of a progressive mesh that a plumb line can touch. One thread at a time.
class PlumbLine {
 public:
  /// Of a seafloor with a progressive mesh, which this keeps.
  explicit PlumbLine(const Seafloor& seafloor);

  double height_m(double x_m, double y_m);

 private:
  std::shared_ptr<const refine::ProgressiveMesh> mesh_;
  std::size_t bed_faces_;
  double highest_m_, lowest_m_;
  refine::Footprint footprint_;
};

}  // namespace ensonify::engine
