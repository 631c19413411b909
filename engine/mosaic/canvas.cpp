#include <ensonify/engine/mosaic/canvas.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ensonify::engine {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

/// The first cell whose centre is at the coordinate `at` or behind it, clamped to [begin, end].
std::int64_t first_cell(double at, std::int64_t begin, std::int64_t end) {
  return static_cast<std::int64_t>(
      std::clamp(std::ceil(at - 0.5), static_cast<double>(begin), static_cast<double>(end)));
}

}  // namespace

Canvas::Canvas(std::int64_t left, std::int64_t top, std::int64_t columns, std::int64_t rows,
               Overlap overlap)
    : left_(left),
      top_(top),
      columns_(columns),
      rows_(rows),
      overlap_(overlap),
      values_(static_cast<std::size_t>(columns * rows), overlap == Overlap::mean ? 0.0f : nan) {
  if (overlap == Overlap::mean) ranks_.assign(values_.size(), 0.0f);
  if (overlap == Overlap::nearest)
    ranks_.assign(values_.size(), std::numeric_limits<float>::infinity());
}

void Canvas::fill(const std::array<Eigen::Vector2d, 4>& corners, float value, float distance_m) {
  const auto [low, high] =
      std::minmax({corners[0].y(), corners[1].y(), corners[2].y(), corners[3].y()});
  const std::int64_t begin = first_cell(low, top_, top_ + rows_);
  const std::int64_t end = first_cell(high, top_, top_ + rows_);
  for (std::int64_t row = begin; row < end; ++row) {
    const double y = static_cast<double>(row) + 0.5;
    std::array<double, 4> crossings;
    crossings.fill(std::numeric_limits<double>::infinity());
    std::size_t count = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      Eigen::Vector2d a = corners[i], b = corners[(i + 1) % 4];
      if ((a.y() <= y) == (b.y() <= y)) continue;
      // Always upwards in y, so that two quadrilaterals with this side compute the same number.
      if (b.y() < a.y()) std::swap(a, b);
      crossings[count++] = a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    }
    std::ranges::sort(crossings);
    for (std::size_t i = 0; i + 1 < count; i += 2) {
      const std::int64_t from = first_cell(crossings[i], left_, left_ + columns_);
      const std::int64_t to = first_cell(crossings[i + 1], left_, left_ + columns_);
      for (std::int64_t column = from; column < to; ++column) {
        const auto cell = static_cast<std::size_t>((row - top_) * columns_ + column - left_);
        switch (overlap_) {
          case Overlap::newest: values_[cell] = value; break;
          case Overlap::mean:
            values_[cell] += value;
            ranks_[cell] += 1.0f;
            break;
          case Overlap::nearest:
            if (distance_m >= ranks_[cell]) break;
            values_[cell] = value;
            ranks_[cell] = distance_m;
            break;
        }
      }
    }
  }
}

float Canvas::at(std::int64_t column, std::int64_t row) const {
  const auto cell = static_cast<std::size_t>(row * columns_ + column);
  if (overlap_ != Overlap::mean) return values_[cell];
  return ranks_[cell] > 0.0f ? values_[cell] / ranks_[cell] : nan;
}

}  // namespace ensonify::engine
