#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace ensonify::engine {

/// Heights on a regular grid, centred on the local origin. Columns run east, rows run north.
struct Heightfield {
  int columns = 0;
  int rows = 0;
  double cell_east_m = 0.0;
  double cell_north_m = 0.0;
  std::vector<double> z_m;  ///< rows * columns, southern row first; NaN marks a hole
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();  ///< the grid's middle, world metres

  int utm_zone = 0;       ///< of the world coordinates, 1 to 60, negative in the south; 0: unknown
  std::string reference;  ///< reference system of the world coordinates as WKT; empty: unknown

  // A window has the coordinates of its larger grid: the origin is the middle of the larger grid.
  int whole_columns = 0, whole_rows = 0;  ///< of the larger grid; 0: this is no window
  int first_column = 0, first_row = 0;    ///< of the window in the larger grid

  double points() const { return static_cast<double>(columns) * rows; }
  bool is_window() const { return whole_columns > 0; }
  int columns_in_all() const { return is_window() ? whole_columns : columns; }
  int rows_in_all() const { return is_window() ? whole_rows : rows; }
  double x_m(int column) const {
    return (first_column + column - 0.5 * (columns_in_all() - 1)) * cell_east_m;
  }
  double y_m(int row) const { return (first_row + row - 0.5 * (rows_in_all() - 1)) * cell_north_m; }
  double& at(int column, int row) { return z_m[index(column, row)]; }
  double at(int column, int row) const { return z_m[index(column, row)]; }
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  /// A part of the grid, without heights. It may reach beyond the grid.
  Heightfield window(int from_column, int from_row, int its_columns, int its_rows) const {
    Heightfield part;
    part.columns = its_columns;
    part.rows = its_rows;
    part.cell_east_m = cell_east_m;
    part.cell_north_m = cell_north_m;
    part.world_origin = world_origin;
    part.utm_zone = utm_zone;
    part.reference = reference;
    part.whole_columns = columns_in_all();
    part.whole_rows = rows_in_all();
    part.first_column = first_column + from_column;
    part.first_row = first_row + from_row;
    return part;
  }
  /// Whether all four corners of the cell north-east of this point have heights.
  bool whole(int column, int row) const {
    return !std::isnan(at(column, row)) && !std::isnan(at(column + 1, row)) &&
           !std::isnan(at(column, row + 1)) && !std::isnan(at(column + 1, row + 1));
  }
};

}  // namespace ensonify::engine
