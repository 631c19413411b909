#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// How high the bed is at a place: a grid over the bed's faces as seen from above. The answer depends on
/// the mesh alone, whatever traces the pings.
class BedBelow {
 public:
  /// The seafloor must outlive this, which takes some 30 bytes a face.
  explicit BedBelow(const Seafloor& seafloor);

  /// Height of the topmost bed face there, local metres, objects left out; NaN over a hole and off the
  /// seafloor.
  double height_m(double x_m, double y_m) const;

  /// The places of the bed's vertices that lie within a box as seen from above, each once.
  std::vector<Eigen::Vector3f> vertices_within(const refine::Bounds& box) const;
  /// The box around the bed.
  refine::Bounds bounds() const { return refine::bounds(bed_); }

 private:
  using Cells = Eigen::Array<std::int64_t, 2, 1>;
  Cells cell_of(const Eigen::Vector2d& place) const;
  /// Calls f(cell) for each cell that the face's outline can meet.
  template <class F>
  void for_each_cell(std::uint32_t face, F&& f) const;

  refine::Triangles bed_;
  Eigen::Vector2d lowest_;
  double cell_m_ = 1.0;
  Cells cells_ = Cells::Zero();
  std::vector<std::uint64_t> first_;  // of a cell's faces; one more at the end
  std::vector<std::uint32_t> faces_;
};

}  // namespace ensonify::engine
