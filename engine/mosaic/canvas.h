#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace ensonify::engine {

/// What a mosaic shows where pings overlap.
enum class Overlap {
  newest,   ///< the last one
  mean,     ///< the mean of all
  nearest,  ///< the one from the shortest ground range; of equals the first
};

/// A rectangle of a grid of cells in which quadrilaterals are filled. Which cells a quadrilateral
/// fills does not depend on the rectangle.
class Canvas {
 public:
  /// `columns` x `rows` cells from cell (`left`, `top`) of the grid on; at first without data.
  Canvas(std::int64_t left, std::int64_t top, std::int64_t columns, std::int64_t rows,
         Overlap overlap);

  /// Puts a value into every cell whose centre is inside a quadrilateral (even-odd rule). Its
  /// corners are in cells of the grid, x to the right and y down: the centre of cell (i, j) is
  /// (i + 0.5, j + 0.5). Quadrilaterals that share a side share no cell and leave none between
  /// them. `distance_m` is the ground range.
  void fill(const std::array<Eigen::Vector2d, 4>& corners, float value, float distance_m);

  /// The value of a cell, counted from the rectangle's corner; NaN without data.
  float at(std::int64_t column, std::int64_t row) const;

 private:
  std::int64_t left_, top_, columns_, rows_;
  Overlap overlap_;
  std::vector<float> values_;  // row by row; with Overlap::mean their sum
  std::vector<float> ranks_;   // the ground range; with Overlap::mean how many
};

}  // namespace ensonify::engine
