#include <ensonify/engine/seafloor/bed/survey_detail.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include <ensonify/engine/seafloor/bed/catmull_rom.h>
#include <ensonify/engine/seafloor/bed/detail_in_windows.h>
#include <ensonify/engine/seafloor/bed/fractal.h>

#include "engine/seafloor/spectrum.h"
#include "support/catch.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// A fractal field, and a survey that holds every n-th point of it.
Heightfield square_fractal(int side, double cell_m, double hurst, std::uint64_t seed) {
  Heightfield field = flat(side, side, cell_m, cell_m);
  add_fractal(field, {.height_at_1m_m = 0.1, .hurst = hurst}, seed);
  return field;
}
Heightfield every(const Heightfield& fine, int n) {
  Heightfield coarse = flat((fine.columns - 1) / n + 1, (fine.rows - 1) / n + 1,
                            n * fine.cell_east_m, n * fine.cell_north_m);
  for (int row = 0; row < coarse.rows; ++row)
    for (int column = 0; column < coarse.columns; ++column)
      coarse.at(column, row) = fine.at(n * column, n * row);
  return coarse;
}

}  // namespace

TEST_CASE("The interpolation's response is its kernel's transform") {
  for (const double x : {0.0, 0.005, 0.2, 1.0, 2.0, 3.14159, 4.0, 6.0, 9.0}) {
    double sum = 0.0;
    constexpr int n = 20000;
    for (int i = 0; i < n; ++i) {
      const double at = 4.0 * (i + 0.5) / n - 2.0;  // from the point whose weight this is
      const double t = at - std::floor(at);
      const auto from_left = static_cast<std::size_t>(1.0 - std::floor(at));
      sum += catmull_rom(t)[from_left] * std::cos(x * at) * 4.0 / n;
    }
    CHECK(catmull_rom_response(x) == Approx(sum).margin(2e-6));
  }
}

TEST_CASE("A survey's roughness is estimated from its finest scales, whatever its slope") {
  for (const double hurst : {0.3, 0.6, 0.85}) {
    double h = 0.0, height = 0.0;
    constexpr int seeds = 6;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      Heightfield survey = every(square_fractal(513, 0.25, hurst, seed), 4);
      for (int row = 0; row < survey.rows; ++row)
        for (int column = 0; column < survey.columns; ++column)
          survey.at(column, row) += 0.3 * survey.x_m(column);
      const FractalScale scale = fractal_scale({&survey, 1});
      h += scale.hurst / seeds;
      height += scale.height_at_1m_m / seeds;
    }
    INFO("H " << hurst);
    // The field that is surveyed lacks waves shorter than its own cells, which matter to a small H.
    CHECK(h == Approx(hurst).margin(hurst < 0.5 ? 0.08 : 0.05));
    CHECK(height == Approx(0.1).epsilon(hurst < 0.5 ? 0.15 : 0.1));
  }
}

TEST_CASE("A survey's spectrum continues below its cell, without a step where the detail begins") {
  constexpr int side = 1025, parts = 8;
  for (const double hurst : {0.4, 0.7}) {
    Spectrum truth(side, side, 0.125, 0.125), continued(side, side, 0.125, 0.125);
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const Heightfield fine = square_fractal(side, 0.125, hurst, seed);
      truth.add(fine);
      continued.add(with_detail(
          every(fine, parts), {.cell_m = 0.125, .height_at_1m_m = 0.1, .hurst = hurst}, seed + 50));
    }
    // Power in rings of wavenumber: below the survey's limit, around it, and above.
    const auto ring = [](const Spectrum& spectrum, double from, double to) {
      double sum = 0.0;
      spectrum.each([&](double kx, double ky, double power) {
        const double k = std::hypot(kx, ky);
        if (k >= from && k < to) sum += power;
      });
      return sum;
    };
    const double nyquist = 3.14159 / (parts * 0.125);
    for (const double low : {0.25, 0.5, 0.8, 1.0, 1.25, 1.6, 2.0, 3.0, 4.0}) {
      INFO("H " << hurst << ", ring from " << low << " of the survey's last wavenumber");
      CHECK(ring(continued, low * nyquist, 1.25 * low * nyquist) /
                ring(truth, low * nyquist, 1.25 * low * nyquist) ==
            Approx(1.0).margin(0.2));
    }
    CHECK(continued.radial_slope(8, 400) == Approx(-(2.0 * hurst + 2.0)).margin(0.15));
  }
}

TEST_CASE("Without roughness the finer grid is smooth, keeps the survey's points and its holes") {
  Heightfield survey = flat(9, 7, 2.0, 3.0);
  for (int row = 0; row < 7; ++row)
    for (int column = 0; column < 9; ++column)
      survey.at(column, row) = 0.3 * survey.x_m(column) - 0.2 * survey.y_m(row);
  survey.at(8, 6) = std::numeric_limits<double>::quiet_NaN();
  survey.world_origin = {500000.0, 4e6, 1.0};
  const Heightfield fine = with_detail(survey, {.cell_m = 0.5, .height_at_1m_m = 0.0}, 1);
  REQUIRE(fine.columns == 33);
  REQUIRE(fine.rows == 37);
  CHECK(fine.cell_north_m == 0.5);
  CHECK(fine.world_origin == survey.world_origin);
  int holes = 0;
  for (int row = 0; row < fine.rows; ++row)
    for (int column = 0; column < fine.columns; ++column) {
      const double z = fine.at(column, row);
      holes += std::isnan(z);
      if (!std::isnan(z))
        REQUIRE(z == Approx(0.3 * fine.x_m(column) - 0.2 * fine.y_m(row)).margin(1e-9));
    }
  CHECK(holes == 4 * 6);  // the cells next to the hole, except on its two other sides
  CHECK(with_detail(survey, {}, 1).columns == 9);
}

TEST_CASE("Detail in windows has the heights of the whole, and relief of the same statistics") {
  constexpr int side = 1025, parts = 8;
  const double hurst = GENERATE(0.4, 0.7);
  CAPTURE(hurst);
  Heightfield survey = every(square_fractal(side, 0.125, hurst, 7), parts);
  survey.at(40, 50) = std::numeric_limits<double>::quiet_NaN();
  const auto of_survey = [&](int first_column, int first_row, int columns, int rows,
                             std::span<double> z_m, std::span<std::uint8_t>) {
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column)
        z_m[static_cast<std::size_t>(row * columns + column)] =
            survey.at(first_column + column, first_row + row);
  };
  const auto heights_of = [&](const SurveyDetail& detail, std::array<int, 4> window,
                              std::uint64_t seed = 3) {
    const auto heights = with_detail_in_windows(survey, of_survey, {&survey, 1}, detail, seed);
    std::vector<double> z_m(static_cast<std::size_t>(window[2] * window[3]));
    heights(window[0], window[1], window[2], window[3], z_m, {});
    return z_m;
  };
  const SurveyDetail smooth{.cell_m = 0.125, .height_at_1m_m = 0.0};
  const SurveyDetail rough{.cell_m = 0.125, .height_at_1m_m = 0.1, .hurst = hurst};
  const Heightfield whole = with_detail(survey, smooth, 3);
  REQUIRE(whole.columns == side);
  const std::vector<double> rough_whole = heights_of(rough, {0, 0, side, side});
  for (const std::array<int, 4> window :
       {std::array{0, 0, 30, 20}, {317, 399, 23, 17}, {1000, 1010, 25, 15}, {1024, 0, 1, 1025}}) {
    const std::vector<double> part = heights_of(smooth, window);
    const std::vector<double> rough_part = heights_of(rough, window);
    for (int row = 0; row < window[3]; ++row)
      for (int column = 0; column < window[2]; ++column) {
        const auto i = static_cast<std::size_t>(row * window[2] + column);
        const std::size_t in_all = whole.index(window[0] + column, window[1] + row);
        REQUIRE(std::bit_cast<std::uint64_t>(part[i]) ==
                std::bit_cast<std::uint64_t>(whole.z_m[in_all]));
        REQUIRE(std::bit_cast<std::uint64_t>(rough_part[i]) ==
                std::bit_cast<std::uint64_t>(rough_whole[in_all]));
      }
  }
  // The relief alone against that of the whole, in rings of wavenumber.
  Spectrum in_windows(side, side, 0.125, 0.125), at_once(side, side, 0.125, 0.125);
  const auto take = [&](Spectrum& spectrum, const std::vector<double>& z_m) {
    Heightfield relief = whole;
    for (std::size_t i = 0; i < z_m.size(); ++i)
      relief.z_m[i] = std::isnan(z_m[i]) ? 0.0 : z_m[i] - whole.z_m[i];
    spectrum.add(relief);
  };
  for (const std::uint64_t seed : {4, 5, 6, 7}) {
    take(in_windows, heights_of(rough, {0, 0, side, side}, seed));
    take(at_once, with_detail(survey, rough, seed + 4).z_m);
  }
  for (const double low : {3.0, 5.0, 8.0, 13.0}) {
    double ours = 0.0, theirs = 0.0;
    const auto ring = [&](double& sum) {
      return [&, low](double kx, double ky, double power) {
        const double k = std::hypot(kx, ky);
        if (k >= low && k < 1.4 * low) sum += power;
      };
    };
    in_windows.each(ring(ours));
    at_once.each(ring(theirs));
    INFO("from " << low << " radians per metre");
    CHECK(ours == Approx(theirs).epsilon(0.07));
  }
}

TEST_CASE("Impossible detail is refused") {
  const Heightfield survey = flat(9, 9, 1.0, 1.0);
  for (const double cell : {1.0, 3.0, -1.0, std::numeric_limits<double>::quiet_NaN(), 1e-6})
    CHECK_THROWS_AS(with_detail(survey, {.cell_m = cell}, 1), std::invalid_argument);
  CHECK_THROWS_AS(with_detail(survey, {.cell_m = 0.25, .height_at_1m_m = 0.1, .hurst = 1.5}, 1),
                  std::invalid_argument);
}
