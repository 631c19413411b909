#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/bed/smooth_field.h>
#include <ensonify/engine/seafloor/layers/boulders.h>
#include <ensonify/engine/seafloor/layers/outcrops.h>
#include <ensonify/engine/seafloor/layers/pits.h>
#include <ensonify/engine/seafloor/layers/seabed.h>
#include <ensonify/engine/seafloor/layers/trawl_marks.h>

#include "engine/seafloor/spectrum.h"
#include "support/catch.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

using std::numbers::pi;

LayerDraws layer_draws(std::uint64_t seed, Purpose purpose = Purpose::test) {
  return {seed, purpose, 1};
}
bool anywhere(double, double) { return true; }

struct Laid {
  Heightfield field;
  std::vector<std::uint32_t> marked;  // number of the feature, from 1
  explicit Laid(Heightfield grid) : field(std::move(grid)), marked(field.z_m.size(), 0) {}
  double marked_share() const {
    return 1.0 -
           static_cast<double>(std::ranges::count(marked, 0u)) / static_cast<double>(marked.size());
  }
};

}  // namespace

TEST_CASE("A smooth field has unit variance, Gaussian tails and the same slope in all directions") {
  double square = 0.0, fourth = 0.0, east = 0.0, north = 0.0, promised = 0.0, n = 0.0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const SmoothField smooth(layer_draws(seed).of(1), 4.0, 16.0);
    const Heightfield grid = flat(200, 200, 0.5, 0.5);
    const std::vector<double> z = smooth.over(grid);
    promised += smooth.slope_per_m() * smooth.slope_per_m() / 30.0;
    for (int row = 0; row + 1 < 200; row += 3)
      for (int column = 0; column + 1 < 200; column += 3) {
        const std::size_t i = grid.index(column, row);
        square += z[i] * z[i];
        fourth += std::pow(z[i], 4);
        east += std::pow((z[i + 1] - z[i]) / 0.5, 2);
        north += std::pow((z[i + 200] - z[i]) / 0.5, 2);
        n += 1.0;
      }
  }
  square /= n;
  CHECK(square == Approx(1.0).epsilon(0.06));
  CHECK(fourth / n / (square * square) == Approx(3.0).epsilon(0.1));
  CHECK(east / n == Approx(promised).epsilon(0.08));
  CHECK(north / n == Approx(promised).epsilon(0.08));
}

TEST_CASE("A smooth field on a fine grid is interpolated from its waves, and nearly their sum") {
  const SmoothField smooth(layer_draws(4).of(1), 5.0, 20.0);
  const Heightfield grid = flat(150, 130, 0.1, 0.13);
  const std::vector<double> z = smooth.over(grid);
  for (int row = 0; row < grid.rows; row += 7)
    for (int column = 0; column < grid.columns; column += 7)
      REQUIRE(z[grid.index(column, row)] ==
              Approx(smooth.at(grid.x_m(column), grid.y_m(row))).margin(0.01));
}

TEST_CASE("Relief has the requested heights below its longest wave, and no more height beyond") {
  const auto difference_m2 = [](const Heightfield& field, int lag) {
    double sum = 0.0;
    for (int row = 0; row < field.rows; ++row)
      for (int column = 0; column + lag < field.columns; ++column)
        sum += std::pow(field.at(column + lag, row) - field.at(column, row), 2);
    return sum / (field.rows * static_cast<double>(field.columns - lag));
  };
  double near = 0.0, far = 0.0, farther = 0.0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Heightfield field = flat(512, 512, 0.25, 0.25);
    add_fractal(field, {.height_at_1m_m = 0.1, .hurst = 0.5, .longest_m = 16.0}, seed);
    near += difference_m2(field, 4) / 6.0;
    far += difference_m2(field, 64) / 6.0;
    farther += difference_m2(field, 192) / 6.0;
  }
  // von Karman's field of H = 1/2 has the exponential variogram 2 s^2 (1 - exp(-k0 d)), of slope
  // 2 s^2 k0 = 0.01 m at the origin.
  const double k0 = 2.0 * pi / 16.0;
  CHECK(near == Approx(0.01 / k0 * (1.0 - std::exp(-k0))).epsilon(0.1));
  CHECK(far == Approx(0.01 / k0).epsilon(0.1));
  CHECK(farther == Approx(far).epsilon(0.1));
}

TEST_CASE("A trawl's doors leave two furrows of the requested depth, width and spacing") {
  const TrawlMarks marks{.count = 1,
                         .depth_m = 0.2,
                         .width_m = 1.0,
                         .door_spacing_m = 12.0,
                         .heading_rad = 0.0,
                         .heading_spread_rad = 0.0,
                         .wander_m = 0.0};
  double deepest = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Laid laid(flat(401, 61, 0.1, 1.0));
    add_trawl_marks(laid.field, marks, layer_draws(seed), laid.marked);
    // One furrow may lie outside the bed: only rows with both are used.
    std::vector<double> spacing;
    for (int row = 0; row < laid.field.rows; ++row) {
      std::vector<int> bottoms;
      for (int column = 1; column + 1 < laid.field.columns; ++column) {
        const double z = laid.field.at(column, row);
        if (z < -0.02 && z <= laid.field.at(column - 1, row) && z < laid.field.at(column + 1, row))
          bottoms.push_back(column);
        deepest = std::min(deepest, z);
      }
      if (bottoms.size() == 2) spacing.push_back(0.1 * (bottoms[1] - bottoms[0]));
    }
    if (spacing.size() < 20) continue;
    const double mean =
        std::accumulate(spacing.begin(), spacing.end(), 0.0) / static_cast<double>(spacing.size());
    CHECK(mean == Approx(12.0).margin(0.5));  // doors sway by 0.25 m each
  }
  CHECK(-deepest > 0.2);          // where the door digs deepest ...
  CHECK(-deepest < 1.6 * 0.201);  // ... at most 1.6 times the mean
}

TEST_CASE("What a trawl's door digs out lies next to the furrow: no volume is lost") {
  Laid laid(flat(601, 11, 0.05, 5.0));
  add_trawl_marks(laid.field,
                  {.count = 40, .width_m = 0.6, .door_spacing_m = 5.0, .heading_spread_rad = 0.0},
                  layer_draws(2), laid.marked);
  double sum = 0.0, size = 0.0;
  for (int row = 0; row < laid.field.rows; ++row)
    for (int column = 0; column < laid.field.columns; ++column) {
      sum += laid.field.at(column, row);
      size += std::abs(laid.field.at(column, row));
    }
  CHECK(size > 10.0);
  CHECK(std::abs(sum) < 0.05 * size);
}

TEST_CASE("Between a trawl's doors lie fine furrows along the tow, of the requested height") {
  TrawlMarks marks{.count = 1,
                   .depth_m = 0.0,
                   .door_spacing_m = 8.0,
                   .sweep_depth_m = 0.01,
                   .heading_spread_rad = 0.0,
                   .wander_m = 0.0};
  double squares = 0.0, along = 0.0, across = 0.0;
  constexpr int seeds = 80, columns = 1000, rows = 400;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    Laid laid(flat(columns, rows, 0.1, 0.15));
    add_trawl_marks(laid.field, marks, layer_draws(seed), laid.marked);
    for (int row = 0; row + 7 < rows; ++row)
      for (int column = 0; column + 5 < columns; ++column) {
        const double z = laid.field.at(column, row);
        squares += z * z;
        along += z * laid.field.at(column, row + 7);
        across += z * laid.field.at(column + 5, row);
      }
  }
  // The height falls as 1 - x^2 from the middle to the doors: its square is 8/15 of the middle's on
  // average. A tow that is drawn over a bed of 100 m has 1.25 % of that beyond the border.
  const double of_strip = 8.0 / 15.0 * 8.0 * 0.9875 * marks.sweep_depth_m * marks.sweep_depth_m;
  CHECK(squares * 0.1 / (seeds * (rows - 7.0)) == Approx(of_strip).epsilon(0.05));
  CHECK(along > 0.95 * squares);             // 1 m further
  CHECK(std::abs(across) < 0.25 * squares);  // half a metre aside

  marks.sweep_depth_m = 0.0;
  Laid none(flat(200, 200, 0.5, 0.5));
  add_trawl_marks(none.field, marks, layer_draws(1), none.marked);
  CHECK(std::ranges::count(none.field.z_m, 0.0) == std::ssize(none.field.z_m));
}

TEST_CASE("A window of a bed has the bits of the whole bed's trawl marks") {
  const TrawlMarks marks{.count = 12, .heading_rad = 0.7};
  Laid whole(flat(900, 700, 0.13, 0.17));
  add_trawl_marks(whole.field, marks, layer_draws(3), whole.marked);
  Heightfield window = flat(150, 120, 0.13, 0.17);
  window.whole_columns = 900;
  window.whole_rows = 700;
  window.first_column = 610;
  window.first_row = 430;
  Laid part(window);
  add_trawl_marks(part.field, marks, layer_draws(3), part.marked);
  int changed = 0;
  for (int row = 0; row < window.rows; ++row)
    for (int column = 0; column < window.columns; ++column) {
      const double z = part.field.at(column, row);
      changed += z != 0.0;
      REQUIRE(z == whole.field.at(610 + column, 430 + row));
    }
  CHECK(changed > 10'000);
}

TEST_CASE("Pits have the requested number, width and depth, and are marked inside") {
  const PitRelief relief{.per_hectare = 30.0,
                         .diameter_m = 6.0,
                         .diameter_spread = 0.0,
                         .depth_ratio = 0.1,
                         .rim_ratio = 0.0};
  double share = 0.0, deepest = 0.0, volume = 0.0;
  constexpr int seeds = 12;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    Laid laid(flat(401, 401, 0.5, 0.5));
    add_pits(laid.field, relief, layer_draws(seed), anywhere, laid.marked);
    share += laid.marked_share() / seeds;
    for (const double z : laid.field.z_m) {
      deepest = std::min(deepest, z);
      volume -= 0.25 * z / (seeds * 4.0);  // per hectare; the area is four hectares
    }
  }
  // Randomly placed discs cover 1 - exp(-density area). The outline's waves add 0.9 %.
  const double area = pi * 9.0 * 1.009;
  CHECK(share == Approx(1.0 - std::exp(-30e-4 * area)).epsilon(0.08));
  // Depths reach from 0.4 to 1.6 of the mean, and up to 9 % farther where a floor leans most.
  CHECK(-deepest == Approx(1.04 * 0.6 * 1.6).epsilon(0.06));
  // A pit has the form (1 - r^2)^p, and p is uniform from 1.2 to 2.8. Some pits overlap.
  const double share_of_cylinder = std::log(3.8 / 2.2) / 1.6;
  CHECK(volume == Approx(30.0 * 0.6 * area * share_of_cylinder).epsilon(0.12));
}

TEST_CASE("Round pits have wider and narrower floors, and are deepest off their middle") {
  struct Pit {
    double points = 0.0, x = 0.0, y = 0.0, depth = 0.0, deepest = 0.0, deepest_x = 0.0,
           deepest_y = 0.0;
  };
  std::vector<double> fillings, offsets;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Laid laid(flat(801, 801, 0.2, 0.2));
    add_pits(laid.field, {.per_hectare = 4.0, .diameter_m = 6.0, .diameter_spread = 0.0},
             layer_draws(seed), anywhere, laid.marked);
    std::map<std::uint32_t, Pit> pits;
    for (int row = 0; row < 801; ++row)
      for (int column = 0; column < 801; ++column) {
        const std::size_t point = laid.field.index(column, row);
        if (laid.marked[point] == 0) continue;
        Pit& pit = pits[laid.marked[point]];
        const double depth = -laid.field.z_m[point];
        pit.points += 1.0;
        pit.x += column;
        pit.y += row;
        pit.depth += depth;
        if (depth <= pit.deepest) continue;
        pit.deepest = depth;
        pit.deepest_x = column;
        pit.deepest_y = row;
      }
    for (const auto& [number, pit] : pits) {
      if (pit.points * 0.04 < 0.8 * pi * 9.0) continue;  // at the border, or under another
      fillings.push_back(pit.depth / pit.points / pit.deepest);
      offsets.push_back(
          0.2 * std::hypot(pit.deepest_x - pit.x / pit.points, pit.deepest_y - pit.y / pit.points));
    }
  }
  REQUIRE(fillings.size() > 60);
  const auto [least, most] = std::ranges::minmax(fillings);
  CHECK(least < 0.29);  // of a cylinder, 1 / (p + 1)
  CHECK(most > 0.41);
  std::ranges::nth_element(offsets, offsets.begin() + std::ssize(offsets) / 2);
  CHECK(offsets[offsets.size() / 2] > 0.2);
}

TEST_CASE("A rim rises from the pit's own bowl without a step") {
  Laid laid(flat(401, 401, 0.05, 0.05));
  add_pits(laid.field,
           {.per_hectare = 100.0, .diameter_m = 5.0, .diameter_spread = 0.0, .rim_ratio = 1.0},
           layer_draws(2), anywhere, laid.marked);
  REQUIRE(laid.marked_share() > 0.05);
  // The steepest side of the bowl, of the rim, and some for outlines that are not round.
  const double depth_m = 1.6 * PitRelief{}.depth_ratio * 5.0;
  const double steepest =
      depth_m / 2.5 * (16.0 / (3.0 * std::sqrt(3.0)) * 0.5 + std::sqrt(2.0 / std::exp(1.0)) / 0.16);
  for (int row = 0; row < 401; ++row)
    for (int column = 0; column + 1 < 401; ++column)
      REQUIRE(std::abs(laid.field.at(column + 1, row) - laid.field.at(column, row)) <
              2.0 * 0.05 * steepest);
}

TEST_CASE("A rim fades away as smoothly where a pit's outline stands out") {
  const PitRelief relief{
      .per_hectare = 20.0, .diameter_m = 5.0, .diameter_spread = 0.0, .rim_ratio = 1.0};
  double steepest = 0.0;  // where less than a tenth of a rim is left
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Laid laid(flat(401, 401, 0.05, 0.05));
    add_pits(laid.field, relief, layer_draws(seed), anywhere, laid.marked);
    for (int row = 0; row < 401; ++row)
      for (int column = 0; column + 1 < 401; ++column)
        if (const double a = laid.field.at(column, row), b = laid.field.at(column + 1, row);
            laid.marked[laid.field.index(column, row)] == 0 &&
            laid.marked[laid.field.index(column + 1, row)] == 0 &&
            std::max(a, b) < 0.1 * 0.4 * relief.depth_ratio * 5.0)
          steepest = std::max(steepest, std::abs(a - b) / 0.05);
  }
  // The slope of a Gaussian at that height, on the narrowest outline.
  CHECK(steepest < 0.4);
}

TEST_CASE("Each feature that is laid looks whether it shall stop") {
  for (const bool pits : {true, false}) {
    SeabedOptions seabed;
    if (pits)
      seabed.pits.emplace_back().relief.per_hectare = 1000.0;
    else
      seabed.boulders.emplace_back().relief.per_hectare = 1000.0;
    Heightfield bed = flat(401, 401, 0.25, 0.25);
    int calls = 0;
    lay_seabed(bed, seabed, "medium sand", 1, nullptr, {.stop_check = [&] { ++calls; }});
    CHECK(calls > 1000);
    const auto stop = [] { throw std::runtime_error("stopped"); };
    CHECK_THROWS_AS(lay_seabed(bed, seabed, "medium sand", 1, nullptr, {.stop_check = stop}),
                    std::runtime_error);
  }
}

TEST_CASE("Outcrops with ledges of any height are laid at once") {
  // Blocks between joints that are as far apart as the ledges are high would be 32 million.
  for (const double height_m : {3.0, 1000.0}) {
    SeabedOptions seabed;
    seabed.outcrops.emplace_back().relief = {.height_m = height_m, .ledge_m = 1000.0};
    Heightfield bed = flat(161, 161, 0.25, 0.25);
    int calls = 0;
    lay_seabed(bed, seabed, "medium sand", 1, nullptr, {.stop_check = [&] { ++calls; }});
    CHECK(calls < 10000);
  }
}

TEST_CASE("Features lie where they are allowed to, whatever the bed's extent") {
  const BoulderField boulders{.per_hectare = 300.0, .scour_ratio = 0.0, .tail_ratio = 0.0};
  Laid large(flat(401, 301, 0.25, 0.25)), small(flat(201, 101, 0.25, 0.25));
  add_boulders(large.field, boulders, layer_draws(3), anywhere, large.marked);
  add_boulders(small.field, boulders, layer_draws(3), anywhere, small.marked);
  for (int row = 0; row < small.field.rows; ++row)
    for (int column = 0; column < small.field.columns; ++column)
      REQUIRE(small.field.at(column, row) ==
              Approx(large.field.at(column + 100, row + 100)).margin(1e-12));
  CHECK(large.marked_share() > 0.01);
  Laid west(flat(401, 301, 0.25, 0.25));
  add_boulders(
      west.field, boulders, layer_draws(3), [](double x, double) { return x < -5.0; }, west.marked);
  CHECK(west.marked_share() > 0.003);
  for (int row = 0; row < west.field.rows; ++row)
    for (int column = 201; column < west.field.columns; ++column)
      REQUIRE(west.field.at(column, row) == 0.0);
}

TEST_CASE("Boulders lie in clusters, as many on average as those that do not") {
  // Independent places have a variance of counts that is their mean (Poisson's distribution).
  const auto counts_of = [](double clustering) {
    constexpr int seeds = 12, points = 600, square = 60;  // squares of 15 m
    std::vector<double> counts;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      Laid laid(flat(points, points, 0.25, 0.25));
      add_boulders(laid.field,
                   {.per_hectare = 300.0,
                    .diameter_m = 0.6,
                    .diameter_spread = 0.0,
                    .scour_ratio = 0.0,
                    .tail_ratio = 0.0,
                    .clustering = clustering},
                   layer_draws(seed), anywhere, laid.marked);
      constexpr int along = points / square;
      std::vector<double> of_squares(along * along);
      std::vector<bool> seen(10000);
      for (int row = 0; row < points; ++row)
        for (int column = 0; column < points; ++column) {
          const std::uint32_t number = laid.marked[laid.field.index(column, row)];
          if (number == 0 || seen.at(number)) continue;
          seen[number] = true;
          of_squares[static_cast<std::size_t>(row / square * along + column / square)] += 1.0;
        }
      counts.insert(counts.end(), of_squares.begin(), of_squares.end());
    }
    double mean = 0.0, square_sum = 0.0;
    for (const double count : counts) mean += count / static_cast<double>(counts.size());
    for (const double count : counts) square_sum += (count - mean) * (count - mean);
    return std::pair(mean, square_sum / static_cast<double>(counts.size()) / mean);
  };
  const auto [scattered, of_scattered] = counts_of(0.0);
  CHECK(scattered == Approx(300.0 * 0.0225).epsilon(0.05));
  CHECK(of_scattered == Approx(1.0).epsilon(0.15));
  const auto [clustered, of_clustered] = counts_of(2.0);
  CHECK(clustered == Approx(scattered).epsilon(0.1));
  CHECK(of_clustered > 1.5);
}

TEST_CASE("A boulder is as high as asked on average, and parts have broken off along flat faces") {
  constexpr double diameter_m = 4.0, height_ratio = 0.4;
  std::map<std::uint32_t, double> highest;
  int inner = 0, slanting = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Laid laid(flat(800, 800, 0.2, 0.2));
    add_boulders(laid.field,
                 {.per_hectare = 30.0,
                  .diameter_m = diameter_m,
                  .diameter_spread = 0.0,
                  .height_ratio = height_ratio,
                  .scour_ratio = 0.0,
                  .tail_ratio = 0.0,
                  .clustering = 0.0},
                 layer_draws(seed), anywhere, laid.marked);
    for (int row = 0; row < laid.field.rows; ++row)
      for (int column = 1; column + 1 < laid.field.columns; ++column) {
        const std::size_t point = laid.field.index(column, row);
        const std::uint32_t stone = laid.marked[point];
        if (stone == 0) continue;
        double& its = highest[static_cast<std::uint32_t>(1000 * seed) + stone];
        its = std::max(its, laid.field.z_m[point]);
        if (laid.marked[point - 1] != stone || laid.marked[point + 1] != stone) continue;
        ++inner;
        const double before = laid.field.z_m[point] - laid.field.z_m[point - 1];
        const double behind = laid.field.z_m[point + 1] - laid.field.z_m[point];
        slanting += std::abs(behind - before) < 1e-9 && std::abs(before) > 0.1 * 0.2;
      }
  }
  double sum = 0.0;
  for (const auto& [stone, height_m] : highest) sum += height_m / diameter_m;
  REQUIRE(highest.size() > 400);
  CHECK(sum / static_cast<double>(highest.size()) == Approx(height_ratio).epsilon(0.05));
  CHECK(slanting > 0.3 * inner);
  CHECK(slanting < 0.9 * inner);
}

TEST_CASE("Boulders may cover the bed twenty times, by the mean square of their diameters") {
  for (const double spread : {0.0, 0.5, 1.0, 2.0}) {
    // The mean square of a log-normal variable with the median 1, limited to 5 (midpoint rule).
    double mean_square = 0.0;
    for (double normal = -9.9995; normal < 10.0; normal += 0.001)
      mean_square += 0.001 * std::exp(-0.5 * normal * normal) / std::sqrt(2.0 * pi) *
                     std::pow(std::min(5.0, std::exp(spread * normal)), 2);
    const auto lay = [&](double cover) {
      Laid laid(flat(2, 2, 0.25, 0.25));
      add_boulders(laid.field,
                   {.per_hectare = cover / (1e-4 * 4.84 * mean_square),
                    .diameter_m = 2.2,
                    .diameter_spread = spread},
                   layer_draws(1), anywhere, laid.marked);
    };
    CHECK_NOTHROW(lay(19.98));
    CHECK_THROWS_WITH(lay(20.02), Catch::Contains("would cover the bed 20.0"));
  }
}

TEST_CASE("A current digs a scour in front of a boulder and leaves a tail behind it") {
  double before = 0.0, behind = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto laid_with = [&](double current_rad) {
      Laid laid(flat(401, 401, 0.2, 0.2));
      add_boulders(laid.field,
                   {.per_hectare = 40.0,
                    .diameter_m = 2.0,
                    .diameter_spread = 0.0,
                    .current_rad = current_rad},
                   layer_draws(seed), anywhere, laid.marked);
      return laid;
    };
    // The boulders are the same, so the difference along the current is the sediment that it moved.
    const Laid north = laid_with(0.0);
    for (int row = 20; row + 20 < 401; ++row)
      for (int column = 0; column < 401; ++column) {
        if (!north.marked[north.field.index(column, row)]) continue;
        const auto bare = [&](int r) {
          return north.marked[north.field.index(column, r)] ? 0.0 : north.field.at(column, r);
        };
        behind += bare(row + 10);
        before += bare(row - 6);
      }
  }
  CHECK(behind > 1.0);
  CHECK(before < -1.0);
}

TEST_CASE("Rock forms ledges: blocks along the dip, each ending with a bed") {
  Laid laid(flat(400, 300, 0.1, 0.1));
  const OutcropRelief relief{.height_m = 3.0,
                             .ledge_m = 0.5,
                             .dip_rad = 0.05,
                             .dip_heading_rad = 0.5 * pi,
                             .roughness_at_1m_m = 0.0};
  std::vector<double> weight(laid.field.z_m.size());
  for (int row = 0; row < 300; ++row)
    for (int column = 0; column < 400; ++column)
      weight[laid.field.index(column, row)] = 0.5 + 0.5 * std::sin(column * 0.01);
  add_outcrops(laid.field, relief, layer_draws(1), weight, laid.marked);
  // On blocks the slope to the east is the dip of the beds, downwards, and their own lean, which is
  // at most 0.06. The height changes from block to block by the thickness of whole beds; blocks
  // that lean and cracks change it in other steps.
  int treads = 0, flat_enough = 0, edges = 0, whole_beds = 0;
  for (int row = 0; row < 300; row += 10)
    for (int column = 0; column + 1 < 400; ++column) {
      if (!laid.marked[laid.field.index(column, row)]) continue;
      ++treads;
      const double slope = (laid.field.at(column + 1, row) - laid.field.at(column, row)) / 0.1;
      flat_enough += std::abs(slope + std::tan(0.05)) < 0.061;
      if (column < 10 || column + 11 >= 400 || std::abs(slope) < 2.0) continue;
      if (!laid.marked[laid.field.index(column - 4, row)] ||
          !laid.marked[laid.field.index(column + 5, row)])
        continue;
      const double beds = (laid.field.at(column + 5, row) - laid.field.at(column - 4, row)) / 0.5;
      ++edges;
      whole_beds += std::abs(beds - std::round(beds)) < 0.25;
    }
  REQUIRE(treads > 1000);
  CHECK(flat_enough > 0.6 * treads);
  REQUIRE(edges > 50);
  CHECK(whole_beds > 0.6 * edges);  // by chance it would be half
}

TEST_CASE("Fallen blocks lie near a cliff, and none farther away") {
  Laid laid(flat(400, 300, 0.1, 0.1));
  std::vector<double> weight(laid.field.z_m.size());
  for (int row = 0; row < 300; ++row)
    for (int column = 0; column < 400; ++column)
      weight[laid.field.index(column, row)] = column < 200 ? 1.0 : 0.3;
  add_outcrops(laid.field,
               {.height_m = 3.0,
                .ledge_m = 0.5,
                .dip_rad = 0.05,
                .dip_heading_rad = 0.5 * pi,
                .roughness_at_1m_m = 0.0},
               layer_draws(1), weight, laid.marked);
  // A block stands on one side as a whole, so rock may end 2 m off; blocks fall by up to 4 m.
  int fallen = 0;
  for (int row = 0; row < 300; ++row)
    for (int column = 225; column < 400; ++column) {
      const std::size_t point = laid.field.index(column, row);
      fallen += laid.marked[point] != 0;
      if (column > 270) REQUIRE(laid.field.z_m[point] == 0.0);
    }
  CHECK(fallen > 20);
}

TEST_CASE("Rock stays in its area, and is about as high as asked for") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Laid laid(flat(401, 401, 0.5, 0.5));
    const OutcropRelief relief{.height_m = 0.5, .ledge_m = 0.2};
    std::vector<double> weight(laid.field.z_m.size());
    for (int row = 0; row < 401; ++row)
      for (int column = 0; column < 401; ++column) {
        const double r = 0.5 * std::hypot(column - 200.0, row - 200.0);
        weight[laid.field.index(column, row)] = std::clamp((40.0 - r) / 20.0, 0.0, 1.0);
      }
    add_outcrops(laid.field, relief, layer_draws(seed), weight, laid.marked);
    double highest = 0.0, inside = 0.0;
    for (std::size_t point = 0; point < weight.size(); ++point) {
      if (weight[point] == 0.0) REQUIRE(laid.field.z_m[point] == 0.0);
      highest = std::max(highest, laid.field.z_m[point]);
      inside += laid.marked[point] != 0;
    }
    CHECK(highest < 3.0 * relief.height_m);
    CHECK(0.25 * inside == Approx(pi * 900.0).epsilon(0.2));  // as far as the weight is a half
  }
}

TEST_CASE("Rock without ledges has neither joints nor fallen blocks") {
  Laid laid(flat(100, 100, 0.1, 0.1));
  std::vector<double> weight(laid.field.z_m.size(), 0.75);
  add_outcrops(laid.field, {.height_m = 2.0, .ledge_m = 0.0, .roughness_at_1m_m = 0.0},
               layer_draws(1), weight, laid.marked);
  for (const double z : laid.field.z_m) REQUIRE(z == 1.0);
}

TEST_CASE("Features with values outside their ranges are refused") {
  Laid laid(flat(10, 10, 1.0, 1.0));
  CHECK_THROWS_AS(add_trawl_marks(laid.field, {.count = -1}, layer_draws(1), laid.marked),
                  std::invalid_argument);
  CHECK_THROWS_AS(add_trawl_marks(laid.field, {.width_m = 0.0}, layer_draws(1), laid.marked),
                  std::invalid_argument);
  CHECK_THROWS_AS(add_pits(laid.field, {.elongation = 0.5}, layer_draws(1), anywhere, laid.marked),
                  std::invalid_argument);
  CHECK_THROWS_AS(
      add_boulders(laid.field, {.diameter_m = -1.0}, layer_draws(1), anywhere, laid.marked),
      std::invalid_argument);
  const std::vector<double> weight(100, 1.0);
  CHECK_THROWS_AS(add_outcrops(laid.field, {.dip_rad = 2.0}, layer_draws(1), weight, laid.marked),
                  std::invalid_argument);
  CHECK_THROWS_AS(SmoothField(layer_draws(1).of(1), 0.0, 1.0), std::invalid_argument);
}
