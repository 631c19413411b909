#pragma once

#include <algorithm>
#include <cmath>

#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// Columns and rows of a grid, both ends included; empty if east < west or north < south.
struct GridRange {
  int west = 0, east = 0, south = 0, north = 0;
};

/// The grid's points up to `reach_m` east, west, north and south of a place.
inline GridRange points_near(const Heightfield& grid, double x_m, double y_m, double reach_m) {
  const auto clamp = [](double index, int first, int count) {
    return static_cast<int>(std::fmin(std::fmax(index - first, -1.0), static_cast<double>(count)));
  };
  const double east = x_m / grid.cell_east_m + 0.5 * (grid.columns_in_all() - 1);
  const double north = y_m / grid.cell_north_m + 0.5 * (grid.rows_in_all() - 1);
  const double wide = reach_m / grid.cell_east_m, high = reach_m / grid.cell_north_m;
  return {
      std::max(0, clamp(std::ceil(east - wide), grid.first_column, grid.columns)),
      std::min(grid.columns - 1, clamp(std::floor(east + wide), grid.first_column, grid.columns)),
      std::max(0, clamp(std::ceil(north - high), grid.first_row, grid.rows)),
      std::min(grid.rows - 1, clamp(std::floor(north + high), grid.first_row, grid.rows))};
}

/// Calls f(column, row, metres east of the place, metres north of it) for each of points_near().
template <class F>
void for_each_point_near(const Heightfield& grid, double x_m, double y_m, double reach_m, F&& f) {
  const GridRange near = points_near(grid, x_m, y_m, reach_m);
  for (int row = near.south; row <= near.north; ++row)
    for (int column = near.west; column <= near.east; ++column)
      f(column, row, grid.x_m(column) - x_m, grid.y_m(row) - y_m);
}

}  // namespace ensonify::engine
