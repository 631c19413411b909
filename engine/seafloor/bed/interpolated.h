#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/seafloor/bed/catmull_rom.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// Values at the points of a grid, interpolated by catmull_rom() from values at the points of a
/// lattice; point (column, row) of the lattice lies at (column, row) * step_m. take_samples(column,
/// row, columns, samples) fills `samples` with the values of the lattice from point (column, row)
/// on, row by row. These values must depend only on the place. Then a window of a grid has the same
/// bits as the whole grid.
template <class TakeSamples>
std::vector<double> interpolated(const Heightfield& grid, double step_m,
                                 TakeSamples&& take_samples) {
  // Counted from the corner of the whole grid, so that a window has the same bits as the grid.
  const double west = std::floor(grid.x_m(-grid.first_column) / step_m) - 1.0;
  const double south = std::floor(grid.y_m(-grid.first_row) / step_m) - 1.0;
  const auto before = [&](double place_m, double edge) {
    return static_cast<std::size_t>(place_m / step_m - edge);
  };
  const std::size_t first_column = before(grid.x_m(0), west) - 1;
  const std::size_t first_row = before(grid.y_m(0), south) - 1;
  const std::size_t columns = before(grid.x_m(grid.columns - 1), west) - first_column + 3;
  const std::size_t rows = before(grid.y_m(grid.rows - 1), south) - first_row + 3;
  std::vector<double> samples(columns * rows);
  take_samples(static_cast<std::int64_t>(west) + static_cast<std::int64_t>(first_column),
               static_cast<std::int64_t>(south) + static_cast<std::int64_t>(first_row), columns,
               std::span(samples));
  struct Along {
    std::size_t first;
    std::array<double, 4> weights;
  };
  std::vector<Along> along(static_cast<std::size_t>(grid.columns));
  for (int column = 0; column < grid.columns; ++column) {
    const double x = grid.x_m(column) / step_m - west;
    const auto left = static_cast<std::size_t>(x);
    along[static_cast<std::size_t>(column)] = {left - 1 - first_column,
                                               catmull_rom(x - static_cast<double>(left))};
  }
  std::vector<double> values(static_cast<std::size_t>(grid.points()));
  std::vector<double> line(columns);
  for (int row = 0; row < grid.rows; ++row) {
    const double y = grid.y_m(row) / step_m - south;
    const auto below = static_cast<std::size_t>(y);
    const auto across = catmull_rom(y - static_cast<double>(below));
    for (std::size_t column = 0; column < columns; ++column) {
      line[column] = 0.0;
      for (std::size_t i = 0; i < 4; ++i)
        line[column] += across[i] * samples[(below - 1 + i - first_row) * columns + column];
    }
    for (int column = 0; column < grid.columns; ++column) {
      const auto& [first, weights] = along[static_cast<std::size_t>(column)];
      double sum = 0.0;
      for (std::size_t i = 0; i < 4; ++i) sum += weights[i] * line[first + i];
      values[grid.index(column, row)] = sum;
    }
  }
  return values;
}

}  // namespace ensonify::engine
