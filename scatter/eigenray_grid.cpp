#include <ensonify/scatter/eigenray_grid.h>

#include <algorithm>
#include <cmath>

namespace ensonify::scatter {
namespace {

using Eigenray = DirectRays::Eigenray;

constexpr double tolerance_m = 1e-5;
constexpr double nearest_m = 0.05;  // the first row begins so far below the source
constexpr double row_ratio = 1.08;  // largest ratio of a row's two depths below the source
constexpr std::array<double, 4> at_nodes{0.0, 0.25, 0.75, 1.0};  // Chebyshev nodes with the ends
/// [node][power]: the coefficients of the cubic that is 1 at this node and 0 at the other three.
constexpr std::array<std::array<double, 4>, 4> by_powers{{{1.0, -19.0 / 3, 32.0 / 3, -16.0 / 3},
                                                          {0.0, 8.0, -56.0 / 3, 32.0 / 3},
                                                          {0.0, -8.0 / 3, 40.0 / 3, -32.0 / 3},
                                                          {0.0, 1.0, -16.0 / 3, 16.0 / 3}}};

/// The bicubic through values at 4 x 4 nodes, [node in depth][node in slope].
std::array<double, 16> through(const std::array<double, 16>& values) {
  std::array<double, 16> cubics{};
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t node = 0; node < 4; ++node)
      for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t b = 0; b < 4; ++b)
          cubics[4 * a + b] += by_powers[row][a] * by_powers[node][b] * values[4 * row + node];
  return cubics;
}

struct Value {
  double at, slope;  // over x
};
Value value_of(const std::array<double, 16>& cubics, double x, double y) {
  double in_x[4];
  for (std::size_t b = 0; b < 4; ++b)
    in_x[b] = cubics[b] + y * (cubics[4 + b] + y * (cubics[8 + b] + y * cubics[12 + b]));
  return {in_x[0] + x * (in_x[1] + x * (in_x[2] + x * in_x[3])),
          in_x[1] + x * (2.0 * in_x[2] + x * 3.0 * in_x[3])};
}

}  // namespace

EigenrayGrid::EigenrayGrid(const SoundSpeedProfile& profile, double shallowest_m, double deepest_m)
    : profile_(&profile), deepest_m_(deepest_m), rays_(profile, shallowest_m, deepest_m) {}

void EigenrayGrid::start_at(double source_depth_m) {
  if (source_m_ == source_depth_m) return;
  source_m_ = source_depth_m;
  rays_.start_at(source_depth_m);
  lay_rows();
  cell_at_.assign(rows_.size() * columns, unmade);
  cells_.clear();
  rough_ = 0;
}

/// Rows end at layers' edges, and where the depth below the source has grown by row_ratio.
void EigenrayGrid::lay_rows() {
  rows_.clear();
  last_row_ = 0;
  const std::vector<SoundSpeedLayer>& layers = profile_->layers();
  double top_m = source_m_ + nearest_m;
  for (std::size_t i = profile_->layer_index(top_m); i < layers.size() && top_m < deepest_m_; ++i) {
    const SoundSpeedLayer& layer = layers[i];
    const double end_m = std::min(layer.bottom_m, deepest_m_);
    while (top_m < end_m) {
      double next_m = source_m_ + row_ratio * (top_m - source_m_);
      if (next_m > end_m - 0.1 * (next_m - top_m)) next_m = end_m;
      const double since_m = layer.gradient_per_s == 0.0 ? 0.0 : top_m - layer.top_m;
      rows_.push_back({top_m, 1.0 / (next_m - top_m),
                       layer.top_mps + layer.gradient_per_s * since_m, layer.gradient_per_s});
      top_m = next_m;
    }
  }
}

bool EigenrayGrid::find(double range_m, double depth_m, Eigenray& way) {
  const double below_m = depth_m - source_m_;
  way.cotangent = range_m / below_m;  // a guess
  const auto cell = cell_of(range_m, depth_m);
  if (!cell) return rays_.find(range_m, depth_m, way);
  const std::uint32_t at = made(*cell);
  if (at == beyond) return false;
  if (at == rough) return rays_.find(range_m, depth_m, way);
  const double x = slope_place(range_m, below_m) - static_cast<double>(cell->column);
  evaluate(cells_[at], rows_[cell->row], x, range_m, depth_m, way);
  return true;
}

/// The place of a point in units of columns. Columns have even steps of k / (k + slope_scale),
/// where k is the cotangent of the straight line to the point.
double EigenrayGrid::slope_place(double range_m, double below_m) {
  return columns * range_m / (range_m + slope_scale * below_m);
}

std::optional<EigenrayGrid::CellNumber> EigenrayGrid::cell_of(double range_m, double depth_m) {
  const double below_m = depth_m - source_m_;
  if (rows_.empty() || !(below_m >= nearest_m && depth_m <= deepest_m_)) return std::nullopt;
  std::size_t row = last_row_;
  if (depth_m < rows_[row].top_m || (row + 1 < rows_.size() && depth_m >= rows_[row + 1].top_m))
    row = last_row_ = static_cast<std::size_t>(
        std::ranges::upper_bound(rows_, depth_m, {}, &Row::top_m) - rows_.begin() - 1);
  return CellNumber{row,
                    std::min(static_cast<std::size_t>(slope_place(range_m, below_m)), columns - 1)};
}

std::uint32_t EigenrayGrid::made(const CellNumber& cell) {
  const std::uint32_t at = cell_at_[cell.row * columns + cell.column];
  return at == unmade ? make(cell.row, cell.column) : at;
}

std::optional<EigenrayGrid::Patch> EigenrayGrid::patch_of(const CellNumber& number) {
  const std::uint32_t at = made(number);
  if (at == beyond || at == rough) return std::nullopt;
  const Cell& cell = cells_[at];
  return Patch{rows_[number.row], static_cast<double>(number.column),
               cell.straight_over_launch.data(), cell.time_s_per_m.data()};
}

void EigenrayGrid::evaluate(const Cell& cell, const Row& row, double x, double range_m,
                            double depth_m, Eigenray& way) const {
  const double down_m = depth_m - row.top_m, y = down_m * row.per_m;
  const double below_m = depth_m - source_m_, cotangent = range_m / below_m;
  const double straight_m = std::sqrt(range_m * range_m + below_m * below_m);
  const Value ratio = value_of(cell.straight_over_launch, x, y);
  const double over_m = range_m + slope_scale * below_m;
  const double x_per_m = columns * slope_scale * below_m / (over_m * over_m);
  const auto between = [&](const std::array<double, 4>& corners) {
    const double near = corners[0] + x * (corners[1] - corners[0]);
    const double far = corners[2] + x * (corners[3] - corners[2]);
    return near + y * (far - near);
  };
  way = {cotangent / ratio.at,
         straight_m * value_of(cell.time_s_per_m, x, y).at,
         straight_m * between(cell.lengths),
         below_m * ratio.at * ratio.at / (ratio.at - range_m * ratio.slope * x_per_m),
         row.top_mps + row.gradient_per_s * down_m,
         straight_m * between(cell.db_per_m)};
}

/// The range that has this x in a cell of the column, at a depth below the source.
double EigenrayGrid::range_at(std::size_t column, double x, double below_m) const {
  const double u = (static_cast<double>(column) + x) / static_cast<double>(columns);
  return slope_scale * below_m * u / (1.0 - u);
}

std::uint32_t EigenrayGrid::make(std::size_t row_number, std::size_t column) {
  const Row& row = rows_[row_number];
  std::uint32_t& place = cell_at_[row_number * columns + column];
  place = rough;
  ++rough_;
  if (column + 1 == columns) return place;  // the last column ends at the horizontal
  const auto depth_at = [&](double y) { return row.top_m + y / row.per_m; };
  Eigenray way;
  const auto exact = [&](double range_m, double depth_m) {
    if (way.cotangent == 0.0) way.cotangent = range_m / (depth_m - source_m_);
    return rays_.find(range_m, depth_m, way);
  };
  Cubics ratios, times;
  std::array<double, 4> lengths, db_per_m;
  for (std::size_t node = 0; node < nodes * nodes; ++node) {
    const double depth_m = depth_at(at_nodes[node / nodes]), below_m = depth_m - source_m_;
    const double range_m = range_at(column, at_nodes[node % nodes], below_m);
    if (!exact(range_m, depth_m)) {
      // The point is beyond the flattest known ray. If the cell's nearest points are beyond it at
      // three depths, the whole cell is.
      const bool all = node == 0 &&
                       !exact(range_at(column, 0.0, depth_at(0.5) - source_m_), depth_at(0.5)) &&
                       !exact(range_at(column, 0.0, depth_at(1.0) - source_m_), depth_at(1.0));
      if (all) --rough_;
      return place = all ? beyond : rough;
    }
    const double straight_m = std::sqrt(range_m * range_m + below_m * below_m);
    ratios[node] =
        range_m > 0.0 ? range_m / (way.cotangent * below_m) : way.range_per_cotangent_m / below_m;
    times[node] = way.time_s / straight_m;
    const std::size_t x = node % nodes, y = node / nodes;
    if (x % 3 == 0 && y % 3 == 0) {
      lengths[y / 3 * 2 + x / 3] = way.path_m / straight_m;
      db_per_m[y / 3 * 2 + x / 3] = way.absorption_db / straight_m;
    }
  }
  const Cell cell{through(ratios), through(times), lengths, db_per_m};
  for (const auto& [x, y] : {std::pair{0.5, 0.5}, {0.5, 0.25}, {0.25, 0.5}}) {
    const double depth_m = depth_at(y), range_m = range_at(column, x, depth_m - source_m_);
    Eigenray told;
    evaluate(cell, row, x, range_m, depth_m, told);
    if (!exact(range_m, depth_m) ||
        std::abs(told.cotangent - way.cotangent) * way.range_per_cotangent_m > 0.5 * tolerance_m ||
        std::abs(told.time_s - way.time_s) * told.sound_speed_mps > 0.5 * tolerance_m)
      return place;
  }
  --rough_;
  place = static_cast<std::uint32_t>(cells_.size());
  cells_.push_back(cell);
  return place;
}

}  // namespace ensonify::scatter
