#include <ensonify/engine/seafloor/layers/bedforms.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <ensonify/engine/seafloor/bed/ripples.h>

#include "engine/seafloor/spectrum.h"
#include "support/catch.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

using std::numbers::pi;

LayerDraws crest_draws(std::uint64_t seed) { return {seed, Purpose::crest_layer, 1}; }

Heightfield crests(const Bedforms& relief, std::uint64_t seed) {
  Heightfield field = flat(320, 256, 0.2, 0.25);
  add_bedforms(field, relief, crest_draws(seed));
  return field;
}

struct Moments {
  double mean = 0.0, rms = 0.0, skewness = 0.0;
};
Moments moments(const std::vector<double>& z) {
  Moments m;
  const auto n = static_cast<double>(z.size());
  for (const double x : z) m.mean += x / n;
  for (const double x : z) m.rms += (x - m.mean) * (x - m.mean) / n;
  m.rms = std::sqrt(m.rms);
  for (const double x : z) m.skewness += std::pow((x - m.mean) / m.rms, 3) / n;
  return m;
}

/// Coefficient of variation of the rms height over windows of about two wavelengths.
double fading(const Heightfield& field, int window) {
  std::vector<double> local;
  for (int row = 0; row + window <= field.rows; row += window)
    for (int column = 0; column + window <= field.columns; column += window) {
      double square = 0.0, mean = 0.0;
      for (int r = 0; r < window; ++r)
        for (int c = 0; c < window; ++c) mean += field.at(column + c, row + r) / (window * window);
      for (int r = 0; r < window; ++r)
        for (int c = 0; c < window; ++c)
          square += std::pow(field.at(column + c, row + r) - mean, 2) / (window * window);
      local.push_back(std::sqrt(square));
    }
  const Moments m = moments(local);
  return m.rms / m.mean;
}

}  // namespace

TEST_CASE("Crests have their wavelength and direction: the spectrum's maximum is there") {
  for (const double heading_deg : {30.0, 90.0, -60.0}) {
    const double heading = heading_deg * pi / 180.0;
    const Bedforms relief{.wavelength_m = 2.5, .height_m = 0.2, .across_crests_rad = heading};
    Spectrum mean(320, 256, 0.2, 0.25);
    for (std::uint64_t seed = 1; seed <= 16; ++seed) mean.add(crests(relief, seed));
    const double k0 = 2.0 * pi / 2.5;
    const double k0x = k0 * std::sin(heading), k0y = k0 * std::cos(heading);
    double all = 0.0, x = 0.0, y = 0.0;
    mean.each([&](double kx, double ky, double power) {
      if (std::hypot(kx, ky) > 1.6 * k0 || std::hypot(kx, ky) < 0.4 * k0) return;
      const double sign = kx * k0x + ky * k0y < 0.0 ? -1.0 : 1.0;  // k and -k are one wave
      all += power;
      x += sign * kx * power;
      y += sign * ky * power;
    });
    INFO("heading " << heading_deg);
    CHECK(std::hypot(x / all - k0x, y / all - k0y) < 0.06 * k0);
  }
}

TEST_CASE("A profile reaches from -1 to 1 and its crests are sharper than its troughs") {
  for (const double sharpness : {0.0, 0.5, 1.0})
    for (const double asymmetry : {0.0, 0.6}) {
      const CrestProfile profile(sharpness, asymmetry);
      std::vector<double> z;
      for (int i = 0; i < 10000; ++i) z.push_back(profile.at(i / 10000.0));
      const auto [low, high] = std::minmax_element(z.begin(), z.end());
      CHECK(*low == Approx(-1.0));
      CHECK(*high == Approx(1.0).margin(1e-3));
      // The crest stands at the end of the gentle side.
      CHECK((high - z.begin()) / 10000.0 == Approx(0.5 * (1.0 + asymmetry)).margin(1e-3));
      if (sharpness == 0.0)
        CHECK(moments(z).skewness == Approx(0.0).margin(1e-6));
      else
        CHECK(moments(z).skewness > 0.2);
      CHECK(profile.at(-0.3) == Approx(profile.at(3.7)));
      // Between the crest and the trough of the gentle side: 1 - 2 sin^p(pi / 4).
      CHECK(profile.at(0.25 * (1.0 + asymmetry)) ==
            Approx(1.0 - 2.0 * std::pow(0.5, 1.0 - 0.5 * sharpness)).margin(1e-9));
    }
}

TEST_CASE("Sharp crests make a skewed bed, round ones none, and the mean stays") {
  const Moments sharp =
      moments(crests({.wavelength_m = 2.0, .height_m = 0.2, .sharpness = 1.0}, 3).z_m);
  const Moments round =
      moments(crests({.wavelength_m = 2.0, .height_m = 0.2, .sharpness = 0.0}, 3).z_m);
  CHECK(sharp.skewness > 0.4);
  CHECK(std::abs(round.skewness) < 0.05);
  CHECK(std::abs(sharp.mean) < 0.004);
  // A cosine's rms is its height over 2 sqrt 2; heights spread by 0.2 add some.
  CHECK(round.rms == Approx(0.2 / std::sqrt(8.0)).epsilon(0.12));
}

TEST_CASE("Crests do not fade as a Gaussian field's do") {
  double trains = 0.0, gaussian = 0.0;
  constexpr int seeds = 4;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Bedforms relief{.wavelength_m = 2.0,
                          .height_m = 0.2,
                          .across_crests_rad = 1.0,
                          .height_spread = 0.2,
                          .raggedness = 0.0};
    trains += fading(crests(relief, seed), 20);
    Heightfield field = flat(320, 256, 0.2, 0.25);
    add_ripples(field, {.rms_height_m = 0.07, .wavelength_m = 2.0, .across_crests_rad = 1.0}, seed);
    gaussian += fading(field, 20);
  }
  CAPTURE(trains / seeds, gaussian / seeds);
  CHECK(gaussian / seeds > 0.35);
  CHECK(trains / seeds < 0.25);
}

TEST_CASE("Where crests are held below the angle of repose, the bed has no crease") {
  const Bedforms relief{.wavelength_m = 5.0,
                        .height_m = 0.3,
                        .across_crests_rad = 0.5 * pi,
                        .asymmetry = 0.6,
                        .height_spread = 0.35,
                        .raggedness = 0.1,
                        .forks = 0.0};
  Heightfield field = flat(801, 801, 0.1, 0.1);
  add_bedforms(field, relief, crest_draws(3));
  // At a crease the curvature along the crests jumps. The gentle sides have no creases.
  constexpr double cell_m = 0.1;
  int gentle = 0, sudden = 0;
  for (int row = 1; row + 2 < field.rows; ++row)
    for (int column = 1; column + 1 < field.columns; ++column) {
      const auto z = [&](int to_row) { return field.at(column, to_row); };
      const double rise = field.at(column + 1, row) - field.at(column - 1, row);
      if (rise < 2.0 * cell_m * 0.02) continue;
      ++gentle;
      const double jump = z(row + 2) - 3.0 * z(row + 1) + 3.0 * z(row) - z(row - 1);
      sudden += std::abs(jump) > 0.5 * cell_m * cell_m * cell_m;
    }
  REQUIRE(gentle > 100000);
  CHECK(sudden < 0.001 * gentle);
}

TEST_CASE(
    "Ragged crests shift by their share of the wavelength, and keep the rms of their height") {
  // Straight crests across the east: of each row, how far its crests lie from their regular places.
  const Bedforms straight{.wavelength_m = 4.0,
                          .height_m = 0.2,
                          .across_crests_rad = 0.5 * pi,
                          .sharpness = 0.0,
                          .bend_rad = 0.0,
                          .height_spread = 0.0,
                          .raggedness = 0.0,
                          .forks = 0.0};
  for (const double raggedness : {0.0, 0.05, 0.1}) {
    Bedforms relief = straight;
    relief.raggedness = raggedness;
    Heightfield field = flat(1201, 601, 0.1, 0.4);
    add_bedforms(field, relief, crest_draws(2));
    double squares = 0.0;
    int count = 0;
    for (int row = 0; row < field.rows; ++row)
      for (int column = 1; column + 1 < field.columns; ++column)
        if (field.at(column, row) > field.at(column - 1, row) &&
            field.at(column, row) >= field.at(column + 1, row)) {
          const double turns = field.x_m(column) / relief.wavelength_m - 0.5;
          squares += std::pow(turns - std::round(turns), 2);
          ++count;
        }
    CAPTURE(raggedness, count);
    CHECK(std::sqrt(squares / count) == Approx(raggedness).epsilon(0.1).margin(0.01));
    CHECK(moments(field.z_m).rms == Approx(0.2 / std::sqrt(8.0)).epsilon(0.05));
  }
}

TEST_CASE("A pair of forks adds a crest between its ends, and none away from it") {
  // Straight crests: along a line across them, the turns of phase are the crests that are counted.
  const auto count = [](double forks, std::uint64_t seed) {
    Heightfield field = flat(400, 400, 0.1, 0.1);
    add_bedforms(field,
                 {.wavelength_m = 2.0,
                  .height_m = 0.2,
                  .across_crests_rad = 0.5 * pi,
                  .sharpness = 0.0,
                  .bend_rad = 0.0,
                  .height_spread = 0.0,
                  .forks = forks},
                 crest_draws(seed));
    std::vector<int> crossings;  // upward, of each row
    for (int row = 0; row < field.rows; ++row) {
      int n = 0;
      for (int column = 0; column + 1 < field.columns; ++column)
        n += field.at(column, row) < 0.0 && field.at(column + 1, row) >= 0.0;
      crossings.push_back(n);
    }
    return crossings;
  };
  const std::vector<int> none = count(0.0, 5), some = count(4.0, 5);
  CHECK(*std::ranges::max_element(none) == *std::ranges::min_element(none));
  CHECK(*std::ranges::max_element(some) - *std::ranges::min_element(some) >= 1);
}

TEST_CASE("Crests are a matter of place: a smaller bed is a part of the larger one") {
  const Bedforms relief{.wavelength_m = 2.0, .height_m = 0.2, .across_crests_rad = 0.4};
  Heightfield large = flat(201, 161, 0.2, 0.2), small = flat(101, 81, 0.2, 0.2);
  add_bedforms(large, relief, crest_draws(7));
  add_bedforms(small, relief, crest_draws(7));
  for (int row = 0; row < small.rows; ++row)
    for (int column = 0; column < small.columns; ++column)
      REQUIRE(small.at(column, row) == Approx(large.at(column + 50, row + 40)).margin(1e-9));
}

TEST_CASE("Crests are the same where their area has all weight, and left out where it has none") {
  const Bedforms relief{.wavelength_m = 2.0, .height_m = 0.2, .across_crests_rad = 0.4};
  Heightfield everywhere = flat(201, 161, 0.2, 0.2), half = everywhere;
  std::vector<double> weight(half.z_m.size(), 0.0);
  for (std::size_t i = 0; i < weight.size(); ++i) weight[i] = i % 201 < 100 ? 1.0 : 0.0;
  add_bedforms(everywhere, relief, crest_draws(7));
  add_bedforms(half, relief, crest_draws(7), weight);
  for (std::size_t i = 0; i < weight.size(); ++i)
    REQUIRE(half.z_m[i] == (weight[i] > 0.0 ? everywhere.z_m[i] : 0.0));
}

TEST_CASE("At the border of their area crests die out one by one, high ones last") {
  const Bedforms relief{
      .wavelength_m = 2.0, .height_m = 0.2, .height_spread = 0.0, .raggedness = 0.1, .forks = 0.0};
  Heightfield everywhere = flat(401, 401, 0.2, 0.2), border = everywhere;
  constexpr double share = 0.3;
  add_bedforms(everywhere, relief, crest_draws(7));
  add_bedforms(border, relief, crest_draws(7), std::vector<double>(border.z_m.size(), share));
  std::vector<std::pair<double, double>> crests;  // height inside, and its share that is left
  for (int row = 1; row + 1 < border.rows; ++row)
    for (int column = 1; column + 1 < border.columns; ++column) {
      const double z = everywhere.at(column, row);
      if (z < 0.04 || z < everywhere.at(column, row - 1) || z < everywhere.at(column, row + 1))
        continue;
      crests.emplace_back(z, share * border.at(column, row) / z);
      REQUIRE(crests.back().second > std::pow(share, std::exp(1.0)) - 1e-12);
      REQUIRE(crests.back().second < std::pow(share, std::exp(-1.0)) + 1e-12);
    }
  REQUIRE(crests.size() > 1000);
  std::ranges::sort(crests);
  const auto mean = [&](std::size_t from, std::size_t to) {
    double sum = 0.0;
    for (std::size_t i = from; i < to; ++i) sum += crests[i].second;
    return sum / static_cast<double>(to - from);
  };
  const std::size_t quarter = crests.size() / 4;
  CHECK(mean(0, quarter) < 0.6 * share);
  CHECK(mean(crests.size() - quarter, crests.size()) > 1.4 * share);
}

TEST_CASE("Crests with values outside their ranges are refused") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Bedforms& wrong :
       {Bedforms{.wavelength_m = 0.0}, Bedforms{.wavelength_m = nan}, Bedforms{.wavelength_m = 0.9},
        Bedforms{.wavelength_m = 2.0, .height_m = -1.0},
        Bedforms{.wavelength_m = 2.0, .sharpness = 1.1},
        Bedforms{.wavelength_m = 2.0, .asymmetry = 1.0},
        Bedforms{.wavelength_m = 2.0, .bend_rad = -0.1},
        Bedforms{.wavelength_m = 2.0, .raggedness = 0.4},
        Bedforms{.wavelength_m = 2.0, .forks = nan}})
    CHECK_THROWS_AS(crests(wrong, 1), std::invalid_argument);
}

TEST_CASE("Crests are hardly ever steeper than sand lies, and their median height stays") {
  // The steepest slope of a profile is its own.
  CHECK(CrestProfile(0.0, 0.0).steepest() == Approx(2.0 * pi).epsilon(1e-5));
  CHECK(CrestProfile(0.0, 0.5).steepest() == Approx(4.0 * pi).epsilon(1e-5));
  for (const double height_m : {0.1, 0.15}) {
    const Bedforms relief{.wavelength_m = 1.0, .height_m = height_m};
    Heightfield field = flat(1201, 1201, 0.05, 0.05);
    add_bedforms(field, relief, crest_draws(3));
    std::size_t steep = 0, all = 0;
    for (int row = 1; row + 1 < field.rows; ++row)
      for (int column = 1; column + 1 < field.columns; ++column) {
        const double east = (field.at(column + 1, row) - field.at(column - 1, row)) / 0.1,
                     north = (field.at(column, row + 1) - field.at(column, row - 1)) / 0.1;
        steep += std::hypot(east, north) > std::tan(33.0 * pi / 180.0);
        ++all;
      }
    const double share = static_cast<double>(steep) / static_cast<double>(all);
    CAPTURE(height_m, share);
    CHECK(share < (height_m == 0.1 ? 0.001 : 0.005));
  }
  // A height that is asked for is made, however steep.
  Bedforms steep{.wavelength_m = 1.0,
                 .height_m = 0.5,
                 .bend_rad = 0.0,
                 .height_spread = 0.0,
                 .raggedness = 0.0,
                 .forks = 0.0};
  Heightfield field = flat(201, 201, 0.05, 0.05);
  add_bedforms(field, steep, crest_draws(3));
  const auto [low, high] = std::ranges::minmax(field.z_m);
  CHECK(high - low == Approx(0.5).epsilon(0.02));
}
