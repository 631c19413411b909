#include <ensonify/engine/mosaic/range_levels.h>

#include <algorithm>
#include <cmath>

namespace ensonify::engine {
namespace {

constexpr double step = 0.02;       // of the ratio's logarithm: 2 % of the range
constexpr std::size_t cells = 346;  // up to a ratio of 1000

/// The place of a ratio among the cells; the middle of cell i is at i + 0.5.
double cell_of(double ratio) {
  return std::clamp(std::log(ratio) / step, 0.0, static_cast<double>(cells) - 0.5);
}

}  // namespace

RangeLevels::RangeLevels() {
  for (std::vector<Cell>& side : cells_) side.resize(cells);
}

void RangeLevels::add(std::size_t side, double ratio, double level) {
  Cell& cell = cells_[side][static_cast<std::size_t>(cell_of(ratio))];
  cell.level += level;
  cell.count += 1.0;
}

void RangeLevels::finish() {
  for (std::vector<Cell>& side : cells_) {
    std::vector<std::size_t> filled;
    for (std::size_t i = 0; i < side.size(); ++i)
      if (side[i].level > 0.0) {
        side[i].level /= side[i].count;
        filled.push_back(i);
      }
    for (std::size_t i = 0; i < side.size(); ++i) {
      if (side[i].level > 0.0) continue;
      const auto nearest = std::ranges::min_element(
          filled, {}, [&](std::size_t other) { return other < i ? i - other : other - i; });
      side[i].level = nearest == filled.end() ? 1.0 : side[*nearest].level;
      // Cells that are filled here are not in `filled`, so the order of cells does not matter.
    }
  }
}

double RangeLevels::mean(std::size_t side, double ratio) const {
  const double at = std::max(cell_of(ratio) - 0.5, 0.0);
  const auto cell = static_cast<std::size_t>(at);
  const double share = at - static_cast<double>(cell);
  const std::vector<Cell>& all = cells_[side];
  return (1.0 - share) * all[cell].level + share * all[std::min(cell + 1, cells - 1)].level;
}

}  // namespace ensonify::engine
