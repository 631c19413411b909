#pragma once

#include <algorithm>
#include <cmath>

#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// The grid's points within `reach_m` of a place: f(column, row, east of the place, north of it).
template <class F>
void for_each_point_near(const Heightfield& grid, double x_m, double y_m, double reach_m, F&& f) {
  const auto clamp = [](double index, int first, int count) {
    return static_cast<int>(std::fmin(std::fmax(index - first, -1.0), static_cast<double>(count)));
  };
  const double east = x_m / grid.cell_east_m + 0.5 * (grid.columns_in_all() - 1);
  const double north = y_m / grid.cell_north_m + 0.5 * (grid.rows_in_all() - 1);
  const double wide = reach_m / grid.cell_east_m, high = reach_m / grid.cell_north_m;
  const int west_end = std::max(0, clamp(std::ceil(east - wide), grid.first_column, grid.columns));
  const int east_end =
      std::min(grid.columns - 1, clamp(std::floor(east + wide), grid.first_column, grid.columns));
  const int south_end = std::max(0, clamp(std::ceil(north - high), grid.first_row, grid.rows));
  const int north_end =
      std::min(grid.rows - 1, clamp(std::floor(north + high), grid.first_row, grid.rows));
  for (int row = south_end; row <= north_end; ++row)
    for (int column = west_end; column <= east_end; ++column)
      f(column, row, grid.x_m(column) - x_m, grid.y_m(row) - y_m);
}

}  // namespace ensonify::engine
