#include <ensonify/refine/height_grid.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <vector>

#include "support/catch.h"
#include "support/heights.h"
#include "support/meshes.h"

using namespace ensonify::refine;
using ensonify::tests::Heights;
using ensonify::tests::random_heights;

namespace {

constexpr double hole = std::numeric_limits<double>::quiet_NaN();

/// The same surface by the rule alone.
TriangleMesh by_rule(const Heights& heights) {
  TriangleMesh mesh;
  std::vector<std::uint32_t> number(heights.z_m.size(), 0);
  std::vector<bool> used(heights.z_m.size(), false);
  std::vector<std::array<std::size_t, 4>> cells;
  const auto at = [&](int column, int row) {
    return static_cast<std::size_t>(row * heights.columns + column);
  };
  for (int row = 0; row + 1 < heights.rows; ++row)
    for (int column = 0; column + 1 < heights.columns; ++column) {
      const std::array corners{at(column, row), at(column + 1, row), at(column, row + 1),
                               at(column + 1, row + 1)};
      if (std::ranges::any_of(corners, [&](std::size_t i) { return std::isnan(heights.z_m[i]); }))
        continue;
      for (const std::size_t i : corners) used[i] = true;
      cells.push_back(corners);
    }
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    number[i] = static_cast<std::uint32_t>(mesh.positions.size());
    const auto columns = static_cast<std::size_t>(heights.columns);
    mesh.positions.emplace_back(heights.x_m()[i % columns], heights.y_m()[i / columns],
                                static_cast<float>(heights.z_m[i]));
  }
  for (const auto& [sw, se, nw, ne] : cells) {
    const double rising = std::abs(heights.z_m[ne] - heights.z_m[sw]);
    const double falling = std::abs(heights.z_m[nw] - heights.z_m[se]);
    const std::uint32_t a = number[sw], b = number[se], c = number[nw], d = number[ne];
    if (rising <= falling) {
      mesh.faces.push_back({a, b, d});
      mesh.faces.push_back({a, d, c});
    } else {
      mesh.faces.push_back({a, b, c});
      mesh.faces.push_back({b, d, c});
    }
  }
  return mesh;
}

}  // namespace

TEST_CASE("A height grid has the faces, vertices, bounds and mean height of its rule") {
  // One tile, tiles that are just full, and a few cells more; with and without holes.
  for (const auto& [columns, rows, holes] :
       {std::tuple{2, 2, 0.0}, {65, 65, 0.0}, {66, 129, 0.0}, {150, 90, 0.02}, {70, 200, 0.3}}) {
    CAPTURE(columns, rows, holes);
    const Heights heights = random_heights(columns, rows, 0.5, 1.0, holes, 3);
    const HeightGrid grid = heights.grid();
    const TriangleMesh expected = by_rule(heights), found = grid.mesh();
    REQUIRE(found.faces == expected.faces);
    REQUIRE(found.positions == expected.positions);
    CHECK(grid.faces() == expected.faces.size());
    CHECK(grid.vertices() == expected.positions.size());
    CHECK(grid.bounds().lowest == bounds(expected).lowest);
    CHECK(grid.bounds().highest == bounds(expected).highest);
    double sum = 0.0;
    for (const Face& face : expected.faces)
      for (const std::uint32_t vertex : face) sum += expected.positions[vertex].z();
    CHECK(grid.mean_height_m() == sum / (3.0 * static_cast<double>(expected.faces.size())));
  }
}

TEST_CASE("A part of a height grid has its faces with their numbers") {
  const Heights heights = random_heights(150, 140, 0.5, 1.0, 0.1, 5);
  const HeightGrid grid = heights.grid();
  const TriangleMesh whole = grid.mesh();
  std::vector<std::uint32_t> numbers;
  const TriangleMesh part = grid.mesh(60, 131, 50, 70, &numbers);
  REQUIRE(part.faces.size() == numbers.size());
  std::vector<bool> in_part(whole.faces.size(), false);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    in_part[numbers[i]] = true;
    for (std::size_t k = 0; k < 3; ++k)
      REQUIRE(part.positions[part.faces[i][k]] == whole.positions[whole.faces[numbers[i]][k]]);
  }
  for (std::size_t face = 0; face < whole.faces.size(); ++face) {
    Eigen::Vector2f middle = Eigen::Vector2f::Zero();
    for (const std::uint32_t vertex : whole.faces[face])
      middle += whole.positions[vertex].head<2>() / 3.0f;
    const bool inside = middle.x() > grid.x(60) && middle.x() < grid.x(131) &&
                        middle.y() > grid.y(50) && middle.y() < grid.y(70);
    REQUIRE(in_part[face] == inside);
  }
}

TEST_CASE("Every range of a height grid holds the heights of its faces, as tightly as it can") {
  const Heights heights = random_heights(200, 300, 0.5, 1.0, 0.2, 8);
  const HeightGrid grid = heights.grid();
  for (int level = 0; level < grid.levels(); ++level)
    for (int row = 0; grid.has_range(level, 0, row); ++row)
      for (int column = 0; grid.has_range(level, column, row); ++column) {
        const int size = HeightGrid::tile_cells << level;
        const TriangleMesh part = grid.mesh(column * size, std::min((column + 1) * size, 199),
                                            row * size, std::min((row + 1) * size, 299));
        const Bounds box = bounds(part);
        REQUIRE(grid.range(level, column, row).lowest == box.lowest.z());
        REQUIRE(grid.range(level, column, row).highest == box.highest.z());
      }
  CHECK(!grid.has_range(grid.levels() - 1, 1, 0));
  CHECK(!grid.has_range(grid.levels() - 1, 0, 1));
}

TEST_CASE("A grid without a whole cell, or that does not fit floats, is refused") {
  Heights heights = random_heights(4, 4, 1.0, 1.0, 0.0, 1);
  for (std::size_t i = 0; i < heights.z_m.size(); i += 2) heights.z_m[i] = hole;
  CHECK_THROWS_AS(heights.grid(), MeshError);
  heights = random_heights(4, 4, 1.0, 1.0, 0.0, 1);
  heights.z_m[5] = 1e39;
  CHECK_THROWS_AS(heights.grid(), MeshError);
  CHECK_THROWS_AS(HeightGridBuilder({0.0f}, {0.0f, 1.0f}, {}), MeshError);
}
