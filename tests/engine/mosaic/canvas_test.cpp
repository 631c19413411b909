// Quadrilaterals on a grid: which cells they fill, and which of several counts.

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <ensonify/engine/mosaic/canvas.h>

#include "support/catch.h"

using Eigen::Vector2d;
using ensonify::engine::Canvas, ensonify::engine::Overlap;

namespace {

using Corners = std::array<Vector2d, 4>;

/// Whether a point is inside, by its winding number: another way than the canvas's.
bool inside(const Corners& corners, const Vector2d& point) {
  double turned_rad = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d a = corners[i] - point, b = corners[(i + 1) % 4] - point;
    turned_rad += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
  }
  return std::abs(turned_rad) > 1.0;
}

constexpr int quads = 12, cells = 70;

/// A sheet of quadrilaterals whose corners are moved at random, over all cells from -5 to 75.
std::vector<Corners> sheet() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> move(-1.5, 1.5);
  std::vector<Vector2d> corners;
  for (int row = 0; row <= quads; ++row)
    for (int column = 0; column <= quads; ++column)
      corners.emplace_back(Vector2d(column, row) * (cells + 10.0) / quads - Vector2d(5.0, 5.0) +
                           Vector2d(move(random), move(random)));
  // Sides that run exactly through centres.
  corners[5 * (quads + 1) + 5] = {30.5, 28.5};
  corners[5 * (quads + 1) + 6] = {35.5, 28.5};
  corners[6 * (quads + 1) + 5] = {30.5, 35.5};
  std::vector<Corners> all;
  for (std::size_t row = 0; row < quads; ++row)
    for (std::size_t column = 0; column < quads; ++column) {
      const std::size_t at = row * (quads + 1) + column;
      all.push_back(
          {corners[at], corners[at + 1], corners[at + quads + 2], corners[at + quads + 1]});
    }
  return all;
}

}  // namespace

TEST_CASE("a quadrilateral fills the cells whose centres are inside") {
  for (const Corners& corners : sheet()) {
    Canvas canvas(0, 0, cells, cells, Overlap::newest);
    canvas.fill(corners, 1.0f, 0.0f);
    for (int row = 0; row < cells; ++row)
      for (int column = 0; column < cells; ++column) {
        const Vector2d centre(column + 0.5, row + 0.5);
        double from_side = 1e9;  // a centre on a side belongs to one of its two neighbours
        for (std::size_t i = 0; i < 4; ++i) {
          const Vector2d a = corners[i], side = (corners[(i + 1) % 4] - a).normalized();
          const Vector2d to = centre - a;
          from_side = std::min(from_side, std::abs(side.x() * to.y() - side.y() * to.x()));
        }
        if (from_side > 1e-9) CHECK(!std::isnan(canvas.at(column, row)) == inside(corners, centre));
      }
  }
}

TEST_CASE("neighbouring quadrilaterals share no cell and leave none out") {
  const std::vector<Corners> all = sheet();
  Canvas forwards(0, 0, cells, cells, Overlap::newest);
  Canvas backwards(0, 0, cells, cells, Overlap::newest);
  for (std::size_t i = 0; i < all.size(); ++i) {
    forwards.fill(all[i], static_cast<float>(i), 0.0f);
    const std::size_t j = all.size() - 1 - i;
    backwards.fill(all[j], static_cast<float>(j), 0.0f);
  }
  for (int row = 0; row < cells; ++row)
    for (int column = 0; column < cells; ++column)
      CHECK(forwards.at(column, row) == backwards.at(column, row));  // NaN would differ
}

TEST_CASE("the cells of a quadrilateral do not depend on the canvas") {
  Canvas whole(0, 0, cells, cells, Overlap::newest), part(17, 23, 30, 20, Overlap::newest);
  for (const Corners& corners : sheet()) {
    const auto value = static_cast<float>(corners[0].x());
    whole.fill(corners, value, 0.0f);
    part.fill(corners, value, 0.0f);
  }
  for (int row = 0; row < 20; ++row)
    for (int column = 0; column < 30; ++column)
      CHECK(part.at(column, row) == whole.at(column + 17, row + 23));
}

TEST_CASE("where quadrilaterals overlap, the newest, the mean or the nearest counts") {
  const auto value = [](Overlap overlap) {
    Canvas canvas(0, 0, 2, 1, overlap);
    const auto square = [](double left) {
      return Corners{Vector2d(left, 0.0), Vector2d(left + 1.0, 0.0), Vector2d(left + 1.0, 1.0),
                     Vector2d(left, 1.0)};
    };
    canvas.fill(square(0.0), 5.0f, 30.0f);
    canvas.fill(square(0.0), 1.0f, 10.0f);
    canvas.fill(square(0.0), 6.0f, 20.0f);
    CHECK(std::isnan(canvas.at(1, 0)));
    return canvas.at(0, 0);
  };
  CHECK(value(Overlap::newest) == 6.0f);
  CHECK(value(Overlap::mean) == 4.0f);
  CHECK(value(Overlap::nearest) == 1.0f);
}
