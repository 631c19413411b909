#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <ensonify/scatter/direct_rays.h>

namespace ensonify::scatter {

/// Does what DirectRays::find does, by interpolation. Two quantities are smooth functions of depth
/// (between the edges of layers) and of the slope of the straight line from the source to the
/// point: the cotangent of this line divided by the cotangent of the launch angle, and the travel
/// time per metre of the line. In each cell of depth and slope, they are bicubic functions through
/// 4 x 4 exact rays. A cell is made when a point first falls into it. It is then compared with
/// exact rays midway between the nodes, where the error is largest. If the error exceeds a
/// hundredth of a millimetre along or across the ray, the cell's points use DirectRays::find.
class EigenrayGrid {
 public:
  /// Arguments and exceptions are those of DirectRays.
  EigenrayGrid(const SoundSpeedProfile& profile, double shallowest_m, double deepest_m);

  /// Moves the source to a depth. Does nothing if it is at this depth already.
  void start_at(double source_depth_m);
  const DirectRays& rays() const { return rays_; }

  /// Finds the ray to a point at range_m and a depth, which must be below the source. Returns false
  /// if no known ray reaches the point.
  bool find(double range_m, double depth_m, DirectRays::Eigenray& way);

  /// Bicubic coefficients in x (slope) and y (depth), 0 to 1 over a cell: [power of y][power of x].
  using Cubics = std::array<double, 16>;
  /// A row of cells, within one layer: y = (depth - top_m) * per_m.
  struct Row {
    double top_m, per_m, top_mps, gradient_per_s;
  };
  /// The data from which the rays to a cell's points are computed, for kernels that compute many.
  struct Patch : Row {
    double column;  ///< x = columns range / (range + slope_scale below) - column
    const double* straight_over_launch;  ///< Cubics: line's cotangent / launch's cotangent
    const double* time_s_per_m;          ///< Cubics: time per metre of the straight line
  };
  static constexpr std::size_t columns = 96;
  static constexpr double slope_scale = 8.0;
  /// The cell of a point at range_m and a depth below the source.
  struct CellNumber {
    std::size_t row, column;
    bool operator==(const CellNumber&) const = default;
  };
  /// None for a point for which find() does not interpolate.
  std::optional<CellNumber> cell_of(double range_m, double depth_m);
  /// None for a cell in which find() does not interpolate, or that no known ray reaches. Valid
  /// until start_at() or find() is called.
  std::optional<Patch> patch_of(const CellNumber& number);

  /// The number of cells made since the source moved, and how many of them were not smooth enough.
  /// Cells that no known ray reaches are not counted.
  std::size_t cells() const { return cells_.size() + rough_; }
  std::size_t rough_cells() const { return rough_; }

 private:
  static constexpr std::size_t nodes = 4;
  static constexpr std::uint32_t unmade = 0xffffffff, rough = 0xfffffffe, beyond = 0xfffffffd;

  struct Cell {
    Cubics straight_over_launch;  // the line's cotangent / the launch's cotangent
    Cubics time_s_per_m;          // time per metre of the straight line
    // At the corners: the ray's length and absorption, divided by the straight line's length.
    std::array<double, 4> lengths, db_per_m;
  };
  void lay_rows();
  static double slope_place(double range_m, double below_m);
  std::uint32_t made(const CellNumber& cell);
  std::uint32_t make(std::size_t row, std::size_t column);
  double range_at(std::size_t column, double x, double below_m) const;
  void evaluate(const Cell& cell, const Row& row, double x, double range_m, double depth_m,
                DirectRays::Eigenray& way) const;

  const SoundSpeedProfile* profile_;
  double deepest_m_;
  double source_m_ = std::numeric_limits<double>::quiet_NaN();
  DirectRays rays_;
  std::vector<Row> rows_;
  std::size_t last_row_ = 0;
  std::vector<std::uint32_t> cell_at_;  // [row][column]
  std::vector<Cell> cells_;
  std::size_t rough_ = 0;
};

}  // namespace ensonify::scatter
