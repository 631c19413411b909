#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <ensonify/scatter/direct_rays.h>

namespace ensonify::scatter {

/// DirectRays::find by interpolation. The straight line's cotangent over the launch's, and the time
/// for each metre of it, are smooth in depth (between the layers' edges) and in the line's slope:
/// cubics in both through 4 x 4 exact ways stand for a cell of these. A cell is made when a point
/// first falls into it, and held to exact ways midway between those, where the error is largest;
/// where it is not within a hundredth of a millimetre of the way there and across, every point is
/// asked exactly.
class EigenrayGrid {
 public:
  /// As DirectRays.
  EigenrayGrid(const SoundSpeedProfile& profile, double shallowest_m, double deepest_m);

  /// From now on from that depth. Nothing is done anew where it was that before.
  void start_at(double source_depth_m);
  const DirectRays& rays() const { return rays_; }

  /// The way to a range and a depth, which must be below the source. False where no known ray
  /// comes.
  bool find(double range_m, double depth_m, DirectRays::Eigenray& way);

  /// Cells made since the source was there, and those of them that were not smooth enough (none of
  /// those that no known ray comes to).
  std::size_t cells() const { return cells_.size() + rough_; }
  std::size_t rough_cells() const { return rough_; }

 private:
  static constexpr std::size_t columns = 96, nodes = 4;
  static constexpr std::uint32_t unmade = 0xffffffff, rough = 0xfffffffe, beyond = 0xfffffffd;

  struct Row {  // of cells, within one layer
    double top_m, per_m, top_mps, gradient_per_s;
  };
  /// Of cubics in x (slope) and y (depth), from 0 to 1 over the cell: [power of y][power of x].
  using Cubics = std::array<double, nodes * nodes>;
  struct Cell {
    Cubics straight_over_launch;  // cotangents
    Cubics time_s_per_m;          // of the straight line
    // Of the way over the straight line's length, at the corners: its own, and its absorption.
    std::array<double, 4> lengths, db_per_m;
  };
  void lay_rows();
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
