#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/trace/grid_scan/grid_scan.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/straightening.h>
#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// A bed of heights in straightened space (Straightening): GridScan follows the planes of a fan
/// over its moved points, so that no face is listed. The bits are those of StraightenedSpace.
class StraightenedBed {
 public:
  /// The grid and the straightening must outlive this.
  StraightenedBed(const refine::HeightGrid& grid, Straightening& straightening, double tolerance_m);

  /// Other triangles, as GridScan::keep_first().
  void keep_first(const refine::Triangles& others, std::uint64_t version,
                  std::span<const RayFan> fans) {
    scan_.keep_first(others, version, fans);
  }

  /// Finds the nearest hits, by ray number. Returns false where it cannot decide all rays of the
  /// fan in this way. The straightening must have started at the fan, which must stay until the
  /// last incidence_of(). The t of a hit is within the tolerance until then; it has no u and v.
  bool trace(const RayFan& fan, std::span<Hit> hits);
  /// The faces that were hit, in the sea, which hits index.
  refine::Triangles triangles() const { return scan_.triangles(); }

  /// As StraightenedSpace::incidence_of().
  RayIncidence incidence_of(std::size_t number, Hit& hit);

 private:
  bool decides_all(const RayFan& fan) const;
  bool find_points(const RayFan& fan);
  bool move_points();
  std::array<std::int32_t, 2> columns_of(std::size_t row) const;
  template <class WithWest, class WithSouth>
  void with_neighbours(std::size_t row, WithWest&& with_west, WithSouth&& with_south) const;
  float find_longest_edge_m();

  const refine::HeightGrid* grid_;
  Straightening* straightening_;
  float most_bow8_m2_;
  GridScan scan_;

  // Of the fan that was traced last:
  std::vector<std::uint64_t> columns_;  // as MovedPoints
  std::vector<std::int32_t> column_0_;
  std::size_t first_row_ = 0, end_row_ = 0;  // rows of the points
  std::size_t room_ = 0;                     // for the points
  std::vector<float> east_m_;                // x of the points of one row
  // By point:
  std::vector<float> heights_m_;
  std::vector<Eigen::Vector4f> moved_;
  std::vector<float> jacobians_;  // as MovedPointRows
};

}  // namespace ensonify::engine
