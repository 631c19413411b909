#pragma once

#include <cstddef>

namespace ensonify::engine {

/// The arrays of coordinates and of Jacobians are this much longer than the number of points.
inline constexpr std::size_t points_padding = 16;

/// Some points of a row of a bed, whose rays are interpolated in one cell of an EigenrayGrid, and
/// that cell: the members of EigenrayGrid::Patch. A plain struct, because kernels must share no
/// inline function with the rest of the program.
struct PointsOfPatch {
  std::size_t count;
  const float* x_m;      ///< to the east
  const float* z_m;      ///< upwards
  double y_m;            ///< to the north
  double source_m[3];    ///< the place of the source
  double source_mps;     ///< the speed of sound there
  double reference_mps;  ///< as in Straightening
  double top_m, per_m, top_mps, gradient_per_s, column;
  double columns, slope_scale;  ///< of the EigenrayGrid
  const double* straight_over_launch;
  const double* time_s_per_m;
};

/// Where moved points are written.
struct MovedPointRows {
  float* positions;           ///< of the first one: x, y, z and 0
  float* jacobians;           ///< of the first one: [column of the matrix][row]
  std::size_t jacobian_room;  ///< from one of these nine to the next
};

/// Straightening::move() for many points at once: the same operations, and the same bits.
void straighten_points(const PointsOfPatch& points, const MovedPointRows& to);

}  // namespace ensonify::engine
