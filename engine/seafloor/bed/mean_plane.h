#pragma once

#include <cmath>
#include <span>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// The plane to which a generated bed adds its relief.
struct MeanPlane {
  double depth_m;  ///< of the plane's middle
  double slope_rad;
  double downhill_rad;  ///< heading down the slope, clockwise from north

  /// The rise of the plane per metre to the east and per metre to the north.
  Eigen::Vector2d rise() const {
    return -std::tan(slope_rad) * Eigen::Vector2d(std::sin(downhill_rad), std::cos(downhill_rad));
  }
};

/// Sets z_m, the heights of a grid's points row by row, to the heights of the plane.
inline void lay(const MeanPlane& plane, const Heightfield& grid, std::span<double> z_m) {
  const Eigen::Vector2d rise = plane.rise();
  for (int row = 0; row < grid.rows; ++row) {
    const double middle_m = rise.y() * grid.y_m(row) - plane.depth_m;
    for (int column = 0; column < grid.columns; ++column)
      z_m[grid.index(column, row)] = rise.x() * grid.x_m(column) + middle_m;
  }
}

}  // namespace ensonify::engine
