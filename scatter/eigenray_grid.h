#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <ensonify/scatter/direct_rays.h>

namespace ensonify::scatter {

/// DirectRays::find by interpolation. Two quantities are smooth in depth (between the layers'
/// edges) and in the slope of the straight line to the point: the line's cotangent over the
/// launch's, and the travel time per metre of the line. In each cell they are bicubic, through 4 x
/// 4 exact rays. A cell is made when a point first falls into it, and is compared with exact rays
/// midway between those, where the error is largest. If the error exceeds a hundredth of a
/// millimetre along or across the ray, all points of the cell use DirectRays::find.
class EigenrayGrid {
 public:
  /// As DirectRays.
  EigenrayGrid(const SoundSpeedProfile& profile, double shallowest_m, double deepest_m);

  /// Moves the source to that depth. Does nothing if it is there already.
  void start_at(double source_depth_m);
  const DirectRays& rays() const { return rays_; }

  /// The ray to a point at range_m and a depth, which must be below the source. Returns false if no
  /// known ray reaches it.
  bool find(double range_m, double depth_m, DirectRays::Eigenray& way);

  /// Bicubic coefficients in x (slope) and y (depth), 0 to 1 over a cell: [power of y][power of x].
  using Cubics = std::array<double, 16>;
  /// What the rays to the points of a cell are computed from, for kernels that do it for many.
  struct Patch {
    double top_m, per_m, top_mps, gradient_per_s;  ///< of its depths: y = (depth - top_m) * per_m
    double column;  ///< x = columns range / (range + slope_scale below) - column
    const double* straight_over_launch;  ///< Cubics: cotangents
    const double* time_s_per_m;          ///< Cubics: of the straight line
  };
  static constexpr std::size_t columns = 96;
  static constexpr double slope_scale = 8.0;
  /// The cell of a point at range_m and a depth below the source.
  struct CellNumber {
    std::size_t row, column;
    bool operator==(const CellNumber&) const = default;
  };
  /// None where find() does not interpolate.
  std::optional<CellNumber> cell_of(double range_m, double depth_m);
  /// None where it does not, or no known ray reaches the cell. Valid until start_at() or find().
  std::optional<Patch> patch_of(const CellNumber& number);

  /// The number of cells made since the source moved, and of those that were not smooth enough.
  /// Cells that no known ray reaches are not counted.
  std::size_t cells() const { return cells_.size() + rough_; }
  std::size_t rough_cells() const { return rough_; }

 private:
  static constexpr std::size_t nodes = 4;
  static constexpr std::uint32_t unmade = 0xffffffff, rough = 0xfffffffe, beyond = 0xfffffffd;

  struct Row {  // a row of cells, within one layer
    double top_m, per_m, top_mps, gradient_per_s;
  };
  struct Cell {
    Cubics straight_over_launch;  // cotangents
    Cubics time_s_per_m;          // of the straight line
    // Per length of the straight line, at the corners: the ray's length, and its absorption.
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
