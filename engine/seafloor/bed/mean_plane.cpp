#include <ensonify/engine/seafloor/bed/mean_plane.h>

#include <cmath>

namespace ensonify::engine {

Eigen::Vector2d MeanPlane::rise() const {
  return -std::tan(slope_rad) * Eigen::Vector2d(std::sin(downhill_rad), std::cos(downhill_rad));
}

void lay(const MeanPlane& plane, const Heightfield& grid, std::span<double> z_m) {
  const Eigen::Vector2d rise = plane.rise();
  for (int row = 0; row < grid.rows; ++row) {
    const double middle_m = rise.y() * grid.y_m(row) - plane.depth_m;
    for (int column = 0; column < grid.columns; ++column)
      z_m[grid.index(column, row)] = rise.x() * grid.x_m(column) + middle_m;
  }
}

}  // namespace ensonify::engine
