#include <ensonify/engine/seafloor/bed/tiled_field.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <vector>

#include <ensonify/engine/seafloor/bed/generated_tiles.h>
#include <ensonify/engine/seafloor/bed/relief_fields.h>

#include "engine/seafloor/spectrum.h"
#include "engine/seafloor/variogram.h"
#include "support/catch.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr int block = TiledField::block_points;
// So few that beds of a few blocks have three bands.
constexpr double few_cells = 65.0 * 65.0;

/// Blocks side by side.
Heightfield in_tiles(const TiledField& tiled, int across, int up, double cell_m) {
  Heightfield field = flat(across * block, up * block, cell_m, cell_m);
  for (int row = 0; row < up; ++row)
    for (int column = 0; column < across; ++column) {
      std::vector<double> z_m(std::size_t{block} * block, 0.0);
      tiled.add_block(column, row, z_m);
      for (int j = 0; j < block; ++j)
        std::copy_n(z_m.begin() + std::ptrdiff_t{j} * block, block,
                    &field.at(column * block, row * block + j));
    }
  return field;
}

double variance(const Heightfield& field) {
  double sum = 0.0, squares = 0.0;
  for (const double z : field.z_m) {
    sum += z;
    squares += z * z;
  }
  const auto n = static_cast<double>(field.z_m.size());
  return squares / n - sum * sum / (n * n);
}

}  // namespace

TEST_CASE("A fractal in tiles has the variogram and the spectrum of a single transform") {
  constexpr double cell_m = 0.25;
  const FractalRelief relief{
      .height_at_1m_m = 0.1,
      .hurst = GENERATE(0.3, 0.7),
      .spectrum = GENERATE(FractalSpectrum::variogram, FractalSpectrum::paper),
      // So that few fields are enough for the longest waves.
      .longest_m = 30.0};
  CAPTURE(relief.hurst, relief.spectrum);
  const Heightfield grid = flat(2 * block, block, cell_m, cell_m);
  Spectrum of_tiles(2 * block, block, cell_m, cell_m), of_one(2 * block, block, cell_m, cell_m);
  // Longer lags need a longer bed: that of 10 km below.
  constexpr std::array<int, 4> lags{1, 2, 5, 16};
  std::array<double, lags.size()> tiles_sum{}, one_sum{};
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const TiledField tiled(grid, fractal_field(grid, relief), seed, Purpose::test, few_cells);
    REQUIRE(tiled.bands() == 3);
    const Heightfield a = in_tiles(tiled, 2, 1, cell_m);
    Heightfield b = grid;
    add_fractal(b, relief, seed + 10);
    of_tiles.add(a);
    of_one.add(b);
    for (std::size_t i = 0; i < lags.size(); ++i) {
      tiles_sum[i] += variogram(a, lags[i], 0) + variogram(a, 0, lags[i]);
      one_sum[i] += variogram(b, lags[i], 0) + variogram(b, 0, lags[i]);
    }
  }
  for (std::size_t i = 0; i < lags.size(); ++i) {
    CAPTURE(lags[i]);
    CHECK(tiles_sum[i] == Approx(one_sum[i]).epsilon(0.05));
  }
  // Waves of 8 to 128 points, over all three bands' borders; then the shortest ones.
  CHECK(std::abs(of_tiles.radial_slope(16, 256) - of_one.radial_slope(16, 256)) < 0.1);
  CHECK(std::abs(of_tiles.radial_slope(128, 700) - of_one.radial_slope(128, 700)) < 0.1);
}

TEST_CASE("A long and narrow fractal in tiles has its mean at zero") {
  constexpr double cell_m = 0.25;
  constexpr int rows = 200;
  constexpr double coarse_cells = 513.0 * 513.0;  // of 4 m, so that the bed is many of them wide
  const Heightfield grid = flat(3 * block, rows, cell_m, cell_m);
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const TiledField tiled(grid, fractal_field(grid, {.height_at_1m_m = 0.1, .hurst = 0.9}), seed,
                           Purpose::test, coarse_cells);
    Heightfield bed = in_tiles(tiled, 3, 1, cell_m);
    bed.rows = rows;  // the rest of the blocks lies beyond the grid
    bed.z_m.resize(static_cast<std::size_t>(bed.points()));
    const double mean_m = std::accumulate(bed.z_m.begin(), bed.z_m.end(), 0.0) / bed.points();
    CAPTURE(seed, std::sqrt(variance(bed)));
    CHECK(std::abs(mean_m) < 0.05 * std::sqrt(variance(bed)));
  }
}

TEST_CASE("Ripples in tiles have their rms height and their wavelength") {
  constexpr double cell_m = 0.1;
  const Heightfield grid = flat(2 * block, block, cell_m, cell_m);
  // From the first band alone to the rest alone.
  const double wavelength_m = GENERATE(0.6, 2.5, 9.0);
  CAPTURE(wavelength_m);
  const RippleRelief ripples{
      .rms_height_m = 0.05, .wavelength_m = wavelength_m, .across_crests_rad = 0.5};
  double variance_m2 = 0.0;
  Spectrum spectrum(2 * block, block, cell_m, cell_m);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const TiledField tiled(grid, ripple_field(grid, ripples), seed, Purpose::test, few_cells);
    const Heightfield field = in_tiles(tiled, 2, 1, cell_m);
    variance_m2 += variance(field) / 3.0;
    spectrum.add(field);
  }
  CHECK(std::sqrt(variance_m2) == Approx(0.05).epsilon(0.08));
  double power = 0.0, sum = 0.0;
  spectrum.each([&](double kx, double ky, double p) {
    power += p;
    sum += p * std::hypot(kx, ky);
  });
  // The mean wavenumber: that of the spectrum, 1 + relative_width^2 or so.
  CHECK(sum / power * wavelength_m / (2.0 * std::numbers::pi) == Approx(1.01).epsilon(0.03));
}

TEST_CASE("A bed in tiles has no seam: steps over a border of blocks are those anywhere") {
  constexpr double cell_m = 0.25;
  const Heightfield grid = flat(2 * block, 2 * block, cell_m, cell_m);
  const TiledField tiled(grid, fractal_field(grid, {.height_at_1m_m = 0.1, .hurst = 0.8}), 9,
                         Purpose::test, few_cells);
  const Heightfield field = in_tiles(tiled, 2, 2, cell_m);
  // Differences of order 1 to 4 over columns (or rows): a step, a bend, a change of roughness.
  const auto detect = [&](int place, bool across, int order) {
    double sum = 0.0;
    for (int i = 0; i < 2 * block; ++i) {
      const auto z = [&](int k) {
        return across ? field.at(place + k, i) : field.at(i, place + k);
      };
      const double difference = order == 1   ? z(0) - z(-1)
                                : order == 2 ? z(0) - 2 * z(-1) + z(-2)
                                : order == 3 ? z(1) - 3 * z(0) + 3 * z(-1) - z(-2)
                                             : z(1) - 4 * z(0) + 6 * z(-1) - 4 * z(-2) + z(-3);
      sum += difference * difference;
    }
    return sum;
  };
  for (const bool across : {true, false})
    for (int order = 1; order <= 4; ++order) {
      CAPTURE(across, order);
      double mean = 0.0, squares = 0.0;
      int count = 0;
      for (int place = 20; place < 2 * block - 20; place += 7) {
        const double power = detect(place, across, order);
        mean += power;
        squares += power * power;
        ++count;
      }
      mean /= count;
      const double sd = std::sqrt(squares / count - mean * mean);
      // Values at the border and beside it are no farther from the mean than other values.
      for (const int place : {block - 1, block, block + 1, block + 2})
        CHECK(std::abs(detect(place, across, order) - mean) < 4.0 * sd);
    }
}

namespace {

/// The expected squared height difference over a distance to the east, of the waves that one
/// transform has: the integral of 2 Phi(k) (1 - cos(kx d)) over the wavenumbers of its cells.
double expected_variogram(const SpectralField& what, double distance_m, double cell_m) {
  constexpr double pi = std::numbers::pi;
  constexpr int rings = 3000, angles = 90;
  const double k_most = std::numbers::sqrt2 * pi / cell_m;
  const double k_least = 2.0 * pi / what.period_m;
  const double step = std::log(k_most / k_least) / rings;
  double sum = 0.0;
  for (int ring = 0; ring < rings; ++ring) {
    const double k = k_least * std::exp((ring + 0.5) * step);
    for (int i = 0; i < angles; ++i) {
      const double angle = 0.5 * pi * (i + 0.5) / angles;
      const double kx = k * std::cos(angle), ky = k * std::sin(angle);
      if (std::max(kx, ky) > pi / cell_m) continue;
      const double amplitude = what.amplitude(kx, ky);
      sum += 2.0 * amplitude * amplitude * (1.0 - std::cos(kx * distance_m)) * k * k;
    }
  }
  return sum * step * 2.0 * pi / angles;
}

Heightfield part_of(const Heightfield& field, int first_column, int columns, int rows) {
  Heightfield part = flat(columns, rows, field.cell_east_m, field.cell_north_m);
  for (int row = 0; row < rows; ++row)
    std::copy_n(field.z_m.begin() + static_cast<std::ptrdiff_t>(field.index(first_column, row)),
                columns, &part.at(0, row));
  return part;
}

/// A bed that consists of the blocks of a tiled field.
Heightfield bed_of_blocks(const Heightfield& grid, const SpectralField& what, std::uint64_t seed) {
  const TiledField tiled(grid, what, seed, Purpose::test);
  Heightfield bed = grid;
  for (int block_row = 0; block_row * block < grid.rows; ++block_row)
    for (int column = 0; column * block < grid.columns; ++column) {
      std::vector<double> z_m(std::size_t{block} * block, 0.0);
      tiled.add_block(column, block_row, z_m);
      const int last_row = std::min(grid.rows, (block_row + 1) * block);
      for (int row = block_row * block; row < last_row; ++row)
        std::copy_n(z_m.begin() + std::ptrdiff_t{row - block_row * block} * block,
                    std::min(block, grid.columns - column * block), &bed.at(column * block, row));
    }
  return bed;
}

/// Beds of 10 km x 200 m against one transform: the slopes of the spectrum, the variogram, and
/// steps over the borders of blocks.
void check_long_bed(double cell_m) {
  const int columns = static_cast<int>(10000.0 / cell_m), rows = static_cast<int>(200.0 / cell_m);
  const FractalRelief relief{.height_at_1m_m = 0.1, .hurst = 0.6};
  const Heightfield grid = flat(columns, rows, cell_m, cell_m);
  const SpectralField what = fractal_field(grid, relief);

  // A bed has few of the longest waves: at a lag of 32 cells its variogram differs by 4 % (rms).
  constexpr int beds = 8;
  const std::array lags{1, 2, 4, 8, 16, 32};
  std::array<double, lags.size()> mean_variogram{};
  Heightfield bed;
  for (std::uint64_t seed = 1; seed <= beds; ++seed) {
    bed = bed_of_blocks(grid, what, seed);
    for (std::size_t i = 0; i < lags.size(); ++i)
      mean_variogram[i] += 0.5 * (variogram(bed, lags[i], 0) + variogram(bed, 0, lags[i])) / beds;
  }
  for (std::size_t i = 0; i < lags.size(); ++i) {
    CAPTURE(lags[i]);
    CHECK(mean_variogram[i] ==
          Approx(expected_variogram(what, lags[i] * cell_m, cell_m)).epsilon(0.05));
  }

  constexpr int side = 1000, other_side = 400;
  Spectrum of_tiles(side, other_side, cell_m, cell_m), of_one(side, other_side, cell_m, cell_m);
  Heightfield one = flat(4 * side, other_side, cell_m, cell_m);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    std::ranges::fill(one.z_m, 0.0);
    add_fractal(one, relief, seed);
    for (int part = 0; part < 4; ++part) of_one.add(part_of(one, part * side, side, other_side));
  }
  for (int first = 0; first + side <= columns; first += side)
    of_tiles.add(part_of(bed, first, side, other_side));
  CHECK(std::abs(of_tiles.radial_slope(10, 100) - of_one.radial_slope(10, 100)) < 0.1);
  CHECK(std::abs(of_tiles.radial_slope(60, 350) - of_one.radial_slope(60, 350)) < 0.1);

  for (int order = 1; order <= 3; ++order) {
    CAPTURE(order);
    const auto steps_at = [&](int column) {
      double sum = 0.0;
      for (int row = 0; row < rows; ++row) {
        const auto z = [&](int k) { return bed.at(column + k, row); };
        const double step = order == 1   ? z(0) - z(-1)
                            : order == 2 ? z(0) - 2 * z(-1) + z(-2)
                                         : z(1) - 3 * z(0) + 3 * z(-1) - z(-2);
        sum += step * step;
      }
      return sum;
    };
    double mean = 0.0, squares = 0.0;
    int count = 0;
    for (int column = 20; column < columns - 20; column += 37) {
      const double power = steps_at(column);
      mean += power;
      squares += power * power;
      ++count;
    }
    mean /= count;
    const double sd = std::sqrt(squares / count - mean * mean);
    // The largest of 80 or more normal numbers is hardly ever beyond 4.5.
    for (int border = block; border < columns - 2; border += block)
      for (const int column : {border - 1, border, border + 1, border + 2})
        CHECK(std::abs(steps_at(column) - mean) < 4.5 * sd);
  }
}

}  // namespace

TEST_CASE("A bed of 10 km x 200 m has the spectrum and the variogram of one transform, no seams",
          "[.soak]") {
  check_long_bed(GENERATE(0.5, 0.2));
}

TEST_CASE("Generated tiles are the same in every window and order, and round to floats") {
  const Heightfield grid = flat(2 * block + 1, block + 300, 0.2, 0.2);
  const FractalRelief relief{.height_at_1m_m = 0.05, .hurst = 0.6};
  const MeanPlane plane{20.0, 0.05, 1.0};
  const auto whole = generated_tiles(grid, plane, relief, {}, 5);
  std::vector<double> all(grid.z_m.size());
  whole(0, 0, grid.columns, grid.rows, all, {});
  const auto parts = generated_tiles(grid, plane, relief, {}, 5);
  struct Part {
    int column, row, columns, rows;
  };
  // The second first, so that borders are sometimes known before and sometimes not.
  for (const Part& part : {Part{block, 0, block + 1, block + 1},
                           {0, 0, block + 1, block + 1},
                           {900, 1000, 200, 100},
                           {0, block, block + 1, 300}}) {
    std::vector<double> z_m(static_cast<std::size_t>(part.columns) *
                            static_cast<std::size_t>(part.rows));
    parts(part.column, part.row, part.columns, part.rows, z_m, {});
    bool same = true;
    for (int row = 0; row < part.rows; ++row)
      for (int column = 0; column < part.columns; ++column) {
        const double z =
            z_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(part.columns) +
                static_cast<std::size_t>(column)];
        same = same && z == all[grid.index(part.column + column, part.row + row)] &&
               z == static_cast<double>(static_cast<float>(z));
      }
    CHECK(same);
  }
}

TEST_CASE("The waves of a bed in tiles must fit kernels") {
  const Heightfield grid = flat(300, 300, 0.2, 0.2);
  const RippleRelief regular{.rms_height_m = 0.01, .wavelength_m = 6.0, .relative_width = 0.01};
  CHECK_THROWS_WITH(TiledField(grid, ripple_field(grid, regular), 1, Purpose::test),
                    Catch::Contains("relative_width"));
}
