#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace ensonify::engine {

/// What a mosaic shows where several pings cover a pixel.
enum class Overlap {
  newest,   ///< the last ping
  mean,     ///< the mean of all pings
  nearest,  ///< the ping with the shortest ground range; of equal ranges the first
};

/// A rectangle of a grid of cells in which quadrilaterals are filled. Whether a quadrilateral fills
/// a cell does not depend on the rectangle.
class Canvas {
 public:
  /// The rectangle has `columns` x `rows` cells from cell (`left`, `top`) on, without data.
  Canvas(std::int64_t left, std::int64_t top, std::int64_t columns, std::int64_t rows,
         Overlap overlap);

  /// Puts a value into every cell whose centre is inside a quadrilateral (even-odd rule). The unit
  /// of the corners is a cell of the grid, x to the right and y down: the centre of cell (i, j) is
  /// (i + 0.5, j + 0.5). Two quadrilaterals on both sides of a common side fill no cell twice and
  /// leave no cell between them. `distance_m` is the ground range.
  void fill(const std::array<Eigen::Vector2d, 4>& corners, float value, float distance_m);

  /// The value of a cell; NaN without data. Columns and rows count from the rectangle's corner.
  float at(std::int64_t column, std::int64_t row) const;

 private:
  std::int64_t left_, top_, columns_, rows_;
  Overlap overlap_;
  std::vector<float> values_;  // row by row; with Overlap::mean the sum of the values
  std::vector<float> ranks_;   // the ground range; with Overlap::mean the number of values
};

}  // namespace ensonify::engine
