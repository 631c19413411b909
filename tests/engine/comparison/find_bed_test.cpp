// The bottom line of lines whose pictures and altitudes are wrong in parts.

#include <ensonify/engine/comparison/find_bed.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "support/catch.h"

using namespace ensonify::engine;

namespace {

constexpr std::size_t bottom_samples = 500, bottom_pings = 400;
constexpr double bottom_range_m = 50.0, bottom_sample_m = bottom_range_m / bottom_samples;

/// The first sample of the bed: 60 to 100.
double bed(std::size_t ping) { return 80.0 + 20.0 * std::sin(0.02 * static_cast<double>(ping)); }

/// Mean amplitudes by sample, where the bed begins at `first`.
double sharp(double sample, double first) { return sample < first ? 5.0 : 500.0; }

/// A port side with speckle, whose pings state the right altitude.
RecordedLine made_line(const std::function<double(double sample, double first)>& level = &sharp) {
  std::mt19937 random(5);
  std::exponential_distribution<float> power;
  RecordedLine line{.samples = bottom_samples};
  for (std::size_t ping = 0; ping < bottom_pings; ++ping) {
    line.pings.push_back({.number = ping,
                          .altitude_m = bed(ping) * bottom_sample_m,
                          .range_m = bottom_range_m,
                          .samples = bottom_samples});
    for (std::size_t k = 0; k < bottom_samples; ++k)
      line.port.push_back(static_cast<float>(level(static_cast<double>(k), bed(ping))) *
                          std::sqrt(power(random)));
  }
  return line;
}

/// Adds fish that are as bright as the bed, with dark samples between the fish and the bed.
void add_fish(RecordedLine& line, std::size_t first, std::size_t end) {
  for (std::size_t ping = first; ping < end; ++ping)
    for (std::size_t k = 30; k < 45; ++k) line.port[ping * bottom_samples + k] = 600.0f;
}

void change_altitudes(RecordedLine& line,
                      const std::function<std::optional<double>(std::size_t, double)>& changed) {
  for (std::size_t ping = 0; ping < bottom_pings; ++ping)
    line.pings[ping].altitude_m = changed(ping, *line.pings[ping].altitude_m);
}

/// The largest distance to the true bottom line, in samples.
double worst(const RecordedLine& line) {
  const FoundBed found = find_bed(line, Side::port);
  double worst = 0.0;
  for (std::size_t ping = 0; ping < bottom_pings; ++ping)
    worst = std::max(worst, std::abs(static_cast<double>(found.first_sample[ping]) - bed(ping)));
  return worst;
}

}  // namespace

TEST_CASE("fish in the water column are not the bed, with and without altitudes") {
  RecordedLine line = made_line();
  add_fish(line, 100, 220);
  CHECK(worst(line) <= 4.0);
  for (RecordedPing& ping : line.pings) ping.altitude_m.reset();
  CHECK(worst(line) <= 4.0);
}

TEST_CASE("a layer over all of the line is not the bed if the altitudes follow the bed") {
  RecordedLine line = made_line();
  add_fish(line, 0, bottom_pings);
  for (const double off_m : {0.0, 10 * bottom_sample_m, -30 * bottom_sample_m}) {
    CAPTURE(off_m);
    RecordedLine moved = line;
    change_altitudes(moved, [&](std::size_t, double altitude_m) { return altitude_m + off_m; });
    CHECK(worst(moved) <= 4.0);
  }
}

TEST_CASE("altitudes that are wrong do not move a bottom line that the samples show") {
  const RecordedLine line = made_line();
  const double right = worst(line);
  CHECK(right <= 4.0);
  for (const double off_m :
       {10 * bottom_sample_m, -10 * bottom_sample_m, 30 * bottom_sample_m, -30 * bottom_sample_m}) {
    CAPTURE(off_m);
    RecordedLine moved = line;
    change_altitudes(moved, [&](std::size_t, double altitude_m) { return altitude_m + off_m; });
    CHECK(worst(moved) == right);
    // In a part of the line, with gaps.
    moved = line;
    change_altitudes(moved, [&](std::size_t ping, double altitude_m) -> std::optional<double> {
      if (ping % 50 < 10) return std::nullopt;
      return ping > 150 && ping < 300 ? altitude_m + off_m : altitude_m;
    });
    CHECK(worst(moved) == right);
  }
  RecordedLine random = line;
  std::mt19937 numbers(1);
  std::uniform_real_distribution<double> altitude_m(1.0, 40.0);
  change_altitudes(random, [&](std::size_t, double) { return altitude_m(numbers); });
  CHECK(worst(random) == right);
}

TEST_CASE("altitudes that follow the fish do not make them the bed") {
  RecordedLine line = made_line();
  add_fish(line, 150, 230);
  change_altitudes(line, [&](std::size_t ping, double altitude_m) {
    return ping >= 150 && ping < 230 ? 30 * bottom_sample_m : altitude_m;
  });
  CHECK(worst(line) <= 4.0);
}

TEST_CASE("pings whose samples do not show the bed have it where their altitude is") {
  RecordedLine line = made_line();
  const auto cover = [&](std::size_t first, std::size_t end) {
    for (std::size_t ping = first; ping < end; ++ping)
      std::fill_n(line.port.begin() + static_cast<std::ptrdiff_t>(ping * bottom_samples),
                  bottom_samples, 400.0f);
  };
  cover(120, 260);
  change_altitudes(line, [&](std::size_t, double altitude_m) { return altitude_m + 3.0; });
  CHECK(worst(line) <= 4.0);
  CHECK_FALSE(find_bed(line, Side::port).stated);
  // Without a stated altitude, the bed is on the line between the pings around.
  RecordedLine bare = line;
  for (RecordedPing& ping : bare.pings) ping.altitude_m.reset();
  const auto filled = static_cast<double>(find_bed(bare, Side::port).first_sample[190]);
  CHECK(filled == Approx(0.5 * (bed(120) + bed(260))).margin(4.0));
  // If no ping shows it, the altitude is taken as it is.
  cover(0, bottom_pings);
  CHECK(find_bed(line, Side::port).stated);
  CHECK(static_cast<double>(find_bed(line, Side::port).first_sample[190]) ==
        Approx(bed(190) + 30.0).margin(3.0));
}

TEST_CASE("the bed begins where it emerges from the water, not where the beam gets bright") {
  // The bed grows over half of its first range; the noise of the water is constant, or a gain
  // amplifies it by 30 dB per factor of ten in range.
  for (const double growth : {0.0, 1.5}) {
    CAPTURE(growth);
    RecordedLine line = made_line([&](double sample, double first) {
      const double water = 2.0 * std::pow((sample + 0.5) / 40.0, growth);
      return water + (sample < first ? 0.0 : 500.0 * std::min(sample / first - 0.9, 0.6));
    });
    CHECK(worst(line) <= 6.0);
    for (RecordedPing& ping : line.pings) ping.altitude_m.reset();
    CHECK(worst(line) <= 6.0);
  }
}

TEST_CASE("the side lobes of a sweep before the bed are not the bed") {
  // The side lobes of a matched filter without a window, x range cells before a bed of constant
  // level, have 1 / (2 pi^2 x) of the bed's power. They reach one length of the pulse. Here a cell
  // is one or four samples.
  for (const int cell : {1, 4}) {
    CAPTURE(cell);
    RecordedLine line = made_line([&](double sample, double first) {
      constexpr double reach = 60.0;
      const double before = std::max(1.0, first - sample) / cell;
      if (sample >= first || first - sample > reach) return sharp(sample, first);
      return std::hypot(5.0, 500.0 / (std::numbers::pi * std::sqrt(2.0 * before)));
    });
    for (std::size_t k = 0; k < line.port.size(); ++k)  // the speckle of a cell
      if (k % bottom_samples % static_cast<std::size_t>(cell) > 0 && k % bottom_samples > 110)
        line.port[k] = line.port[k - 1];
    CHECK(worst(line) <= 5.0 + 2.0 * cell);
    for (RecordedPing& ping : line.pings) ping.altitude_m.reset();
    CHECK(worst(line) <= 5.0 + 2.0 * cell);
  }
}

TEST_CASE("the altitude counts where the bed behind it is too dark to be seen in single pings") {
  RecordedLine line = made_line([](double sample, double first) {
    return sample < first ? 5.0 : sample < 1.4 * first ? 6.5 : 500.0;
  });
  const FoundBed found = find_bed(line, Side::port);
  CHECK(found.stated);
  CHECK(worst(line) <= 3.0);
  // There is nothing at another altitude, so the bed is where it is bright.
  change_altitudes(line, [](std::size_t, double altitude_m) { return 0.7 * altitude_m; });
  CHECK_FALSE(find_bed(line, Side::port).stated);
  const std::vector<std::size_t> bright = find_bed(line, Side::port).first_sample;
  for (std::size_t ping = 0; ping < bottom_pings; ++ping)
    CHECK(static_cast<double>(bright[ping]) > 1.2 * bed(ping));
}

TEST_CASE("a bed that ends before half of the range is found") {
  RecordedLine line = made_line(
      [](double sample, double first) { return sample < 200.0 ? sharp(sample, first) : 0.0; });
  CHECK(worst(line) <= 4.0);
  CHECK_FALSE(find_bed(line, Side::port).stated);
}

TEST_CASE("samples before the first that was recorded are no water, darker than the noise") {
  RecordedLine line =
      made_line([](double sample, double first) { return sample < first ? 50.0 : 500.0; });
  const std::vector<std::size_t> whole = find_bed(line, Side::port).first_sample;
  constexpr std::size_t unrecorded = 30;
  for (std::size_t ping = 0; ping < bottom_pings; ++ping) {
    line.pings[ping].unrecorded = unrecorded;
    line.pings[ping].altitude_m.reset();
    std::fill_n(line.port.begin() + static_cast<std::ptrdiff_t>(ping * bottom_samples), unrecorded,
                0.0f);
  }
  const std::vector<std::size_t> late = find_bed(line, Side::port).first_sample;
  for (std::size_t ping = 0; ping < bottom_pings; ++ping) {
    CAPTURE(ping);
    CHECK(static_cast<double>(late[ping]) ==
          Approx(static_cast<double>(whole[ping])).epsilon(0).margin(2.0));
  }
}
