#include <ensonify/engine/image/display.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "support/catch.h"

using namespace ensonify::engine;

namespace {

constexpr double alpha = 0.1;  // dB/m

/// A flat bed under a line array: no echo up to bin 20, then intensity as r^-3 with absorption.
Waterfall flat_bed(std::size_t pings, int bins) {
  Sonar sonar;
  sonar.bins = bins;
  sonar.range_m = 75.0;
  Waterfall waterfall(sonar, pings);
  for (std::size_t ping = 0; ping < pings; ++ping) {
    EchoLine sides[2];
    sides[1].sector = 1;
    for (EchoLine& line : sides) {
      line.bins.assign(static_cast<std::size_t>(bins));
      for (int i = 0; i < bins; ++i) {
        const double r = (i + 0.5) * sonar.bin_m();
        const auto bin = static_cast<std::size_t>(i);
        line.bins.range_m[bin] = static_cast<float>(r);
        line.bins.region[bin] =
            static_cast<std::uint32_t>(i < 20 ? Region::water_column : Region::seabed);
        if (i >= 20)
          line.bins.intensity[bin] =
              static_cast<float>(1e12 * std::pow(r, -3.0) * std::pow(10.0, -0.2 * alpha * r));
      }
    }
    waterfall.set_row(ping, sides, {});
  }
  return waterfall;
}

/// The calibration of a scene with the bed of flat_bed(), without speckle.
Calibration calibration_of(const Sonar& sonar) {
  Calibration made{.absorption_db_per_m = alpha};
  const Waterfall bed = flat_bed(1, sonar.bins);
  for (std::size_t i = 0; i < bed.columns(); ++i) made.level_bed.push_back(bed.pixels.intensity[i]);
  return made;
}

Picture shown_at_share(const Waterfall& waterfall, const Display& display, double share = 1.0) {
  Calibration calibration = calibration_of(waterfall.sonar);
  calibration.median_share = share;
  return render(waterfall, display, calibration);
}

const std::uint8_t middle = 99;              // 255 * 0.35^0.9
const Display levelling{.spreading = 30.0};  // makes flat_bed() even

}  // namespace

TEST_CASE("The gain shows a flat bed evenly at mid-brightness, and leaves the water black") {
  const Waterfall waterfall = flat_bed(4, 200);
  const Picture picture = shown_at_share(waterfall, levelling);
  CHECK(picture.width == 400);
  CHECK(picture.height == 4);
  CHECK(picture.channels == 1);
  REQUIRE(picture.pixels.size() == 1600);
  int wrong = 0;
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    const std::size_t column = i % 400;
    const bool water = column >= 180 && column < 220;
    wrong += picture.pixels[i] != (water ? 0 : middle);
  }
  CHECK(wrong == 0);
}

TEST_CASE("Each part of the gain law has its documented effect") {
  const Waterfall waterfall = flat_bed(1, 200);
  const auto ratio = [&](const Display& display) {  // of amplitude, bin 150 to bin 40
    const Picture picture = shown_at_share(waterfall, display);
    return std::pow(double(picture.pixels[350]) / double(picture.pixels[240]), 1.0 / display.gamma);
  };
  const double r1 = 40.5 * 0.375, r2 = 150.5 * 0.375;
  Display display;
  display.spreading = 20.0;
  CHECK(ratio(display) == Approx(std::pow(10.0, -10.0 * std::log10(r2 / r1) / 20.0)).epsilon(0.03));
  display.spreading = 30.0;
  display.absorption = false;
  CHECK(ratio(display) == Approx(std::pow(10.0, -2.0 * alpha * (r2 - r1) / 20.0)).epsilon(0.03));

  display = levelling;
  display.gamma = 1.0;
  CHECK(int(shown_at_share(waterfall, display).pixels[300]) == 89);  // 255 * 0.35
  display.gain_db = 6.0;
  CHECK(int(shown_at_share(waterfall, display).pixels[300]) == 178);  // 255 * 0.35 * 10^(6/20)
  display.gain_db = 20.0;
  CHECK(int(shown_at_share(waterfall, display).pixels[300]) == 255);
}

TEST_CASE("Each pixel has the step of its level, by the formula of the mapping") {
  Waterfall waterfall = flat_bed(100, 200);
  std::mt19937 engine(1);
  std::uniform_real_distribution<double> octaves(-45.0, 15.0);
  std::vector<double> levels(waterfall.pixels.intensity.size());
  for (std::size_t i = 0; i < levels.size(); ++i) {
    levels[i] = std::exp2(octaves(engine));
    waterfall.pixels.intensity[i] *= static_cast<float>(levels[i]);
  }
  for (const Mapping mapping : {Mapping::gamma, Mapping::logarithmic})
    for (const double gamma : {0.4, 0.7, 1.5}) {
      Display display = levelling;
      display.mapping = mapping;
      display.gamma = gamma;
      const Picture picture = shown_at_share(waterfall, display);
      int wrong = 0, between = 0;
      for (std::size_t i = 0; i < levels.size(); ++i) {
        const std::size_t column = i % 400, row = i / 400;
        if (column >= 180 && column < 220) continue;  // the water
        const double light = mapping == Mapping::gamma
                                 ? std::pow(0.35 * 0.35 * levels[i], 0.5 * gamma)
                                 : 0.5 + 10.0 * std::log10(levels[i]) / display.range_db;
        const double step = 255.0 * std::clamp(light, 0.0, 1.0);
        const int pixel = picture.pixels[(99 - row) * 400 + column];
        wrong += std::abs(pixel - step) > 0.5 + 1e-4;  // the bed's floats are that far off
        between += pixel > 0 && pixel < 255;
      }
      CAPTURE(gamma);
      CHECK(wrong == 0);
      CHECK(between > 3000);
    }
}

TEST_CASE("The newest ping is on top, port is left, and each bin has its column") {
  Waterfall waterfall = flat_bed(5, 100);
  // One bright target: second ping, port, bin 70. One dark: last ping, starboard, bin 30.
  waterfall.pixels.intensity[1 * 200 + (99 - 70)] *= 1e6f;
  waterfall.pixels.intensity[4 * 200 + 100 + 30] = 0.0f;
  waterfall.pixels.region[4 * 200 + 100 + 30] = static_cast<std::uint32_t>(Region::shadow);
  const Picture picture = shown_at_share(waterfall, levelling);
  for (std::size_t row = 0; row < 5; ++row)
    for (std::size_t column = 0; column < 200; ++column) {
      const bool bright = row == 3 && column == 29;
      const bool dark = (row == 0 && column == 130) || (column >= 80 && column < 120);
      const int expected = bright ? 255 : dark ? 0 : middle;
      CAPTURE(row, column);
      REQUIRE(int(picture.pixels[row * 200 + column]) == expected);
    }
}

TEST_CASE("Pings not yet received are black and do not change the brightness of the others") {
  const Waterfall whole = flat_bed(6, 100);
  Waterfall part(whole.sonar, 6);
  for (std::size_t i = 0; i < 2 * 200; ++i) {
    part.pixels.intensity[i] = whole.pixels.intensity[i];
    part.pixels.region[i] = whole.pixels.region[i];
    part.pixels.range_m[i] = whole.pixels.range_m[i];
  }
  const Picture picture = shown_at_share(part, {});
  const Picture full = shown_at_share(whole, {});
  CHECK(std::all_of(picture.pixels.begin(), picture.pixels.begin() + 4 * 200,
                    [](auto p) { return p == 0; }));
  CHECK(std::equal(picture.pixels.begin() + 4 * 200, picture.pixels.end(),
                   full.pixels.begin() + 4 * 200));

  const Picture nothing = shown_at_share(Waterfall(whole.sonar, 3), {});
  CHECK(nothing.pixels == std::vector<std::uint8_t>(3 * 200, 0));
  CHECK(shown_at_share(Waterfall(whole.sonar, 0), {}).pixels.empty());
}

TEST_CASE(
    "Half of a speckled seabed is brighter than mid-brightness, shadow and water do not count") {
  Waterfall waterfall = flat_bed(50, 200);
  std::mt19937_64 random(1);
  std::exponential_distribution<float> speckle;
  std::size_t seabed = 0, above = 0;
  for (std::size_t i = 0; i < waterfall.pixels.intensity.size(); ++i) {
    waterfall.pixels.intensity[i] *= speckle(random);
    if (i % 3 == 0) {
      waterfall.pixels.intensity[i] = 1.0f;  // noise
      waterfall.pixels.region[i] = static_cast<std::uint32_t>(Region::shadow);
    }
  }
  const Picture picture = shown_at_share(waterfall, levelling, std::log(2.0));
  for (std::size_t row = 0; row < 50; ++row)
    for (std::size_t column = 0; column < 400; ++column) {
      const std::size_t i = row * 400 + column;
      if (waterfall.pixels.region[i] == static_cast<std::uint32_t>(Region::seabed)) {
        ++seabed;
        above += picture.pixels[(49 - row) * 400 + column] > middle;
      } else {
        REQUIRE(picture.pixels[(49 - row) * 400 + column] < 5);
      }
    }
  CHECK(double(above) / double(seabed) == Approx(0.5).margin(0.01));
}

TEST_CASE("Copper goes from black to pale yellow, never gets darker, and is always warm") {
  Waterfall waterfall = flat_bed(1, 200);
  for (std::size_t i = 0; i < 200; ++i) {  // a ramp of amplitude to starboard
    const double r = (static_cast<double>(i) + 0.5) * 0.375;
    waterfall.pixels.region[200 + i] = static_cast<std::uint32_t>(Region::seabed);
    waterfall.pixels.intensity[200 + i] =
        static_cast<float>(1e12 * std::pow(std::max(r, 0.375), -3.0) *
                           std::pow(10.0, -0.2 * alpha * std::max(r, 0.375)) *
                           std::pow(static_cast<double>(i) / 66.0, 2));
  }
  Display display;
  display.palette = Palette::copper;
  const Picture picture = shown_at_share(waterfall, display);
  CHECK(picture.channels == 3);
  const std::uint8_t* ramp = picture.pixels.data() + 200 * 3;
  for (std::size_t i = 0; i < 200; ++i) {
    const std::uint8_t *colour = ramp + 3 * i, *before = ramp + 3 * (i ? i - 1 : 0);
    CAPTURE(i, int(colour[0]), int(colour[1]), int(colour[2]));
    REQUIRE((colour[0] >= colour[1] && colour[1] >= colour[2]));
    for (std::size_t k = 0; k < 3; ++k) REQUIRE(colour[k] >= before[k]);
  }
  CHECK((ramp[0] == 0 && ramp[1] == 0 && ramp[2] == 0));
  const std::uint8_t* last = ramp + 3 * 199;
  CHECK((last[0] > 240 && last[1] > 220 && last[2] > 150 && last[2] < 220));
}

TEST_CASE(
    "Brightness depends on the scene, not on the picture: a bed four times as strong is whiter") {
  Waterfall waterfall = flat_bed(3, 200);
  for (float& intensity : waterfall.pixels.intensity) intensity *= 4.0f;
  Display display = levelling;
  display.gamma = 1.0;
  CHECK(double(shown_at_share(waterfall, display).pixels[300]) == Approx(255 * 0.35 * 2).margin(1));
}

TEST_CASE("A picture made line by line equals the picture of all lines") {
  Waterfall waterfall = flat_bed(7, 100);
  std::mt19937_64 random(2);
  std::exponential_distribution<float> speckle;
  for (float& intensity : waterfall.pixels.intensity) intensity *= speckle(random);
  for (PingRow& ping : waterfall.pings) ping.altitude_m = 7.5;
  for (const Mapping mapping : {Mapping::gamma, Mapping::logarithmic})
    for (const bool over_ground : {false, true}) {
      Display display{.slant_range_correction = over_ground, .mapping = mapping};
      const Picture all = shown_at_share(waterfall, display);
      const Renderer renderer(waterfall.sonar, display, calibration_of(waterfall.sonar));
      for (std::size_t row = 0; row < 7; ++row) {
        Waterfall line(waterfall.sonar, 1);
        const auto from = static_cast<std::ptrdiff_t>(200 * row);
        BinLayers::for_each([&](std::string_view, auto layer) {
          const auto begin = (waterfall.pixels.*layer).begin() + from;
          (line.pixels.*layer).assign(begin, begin + 200);
        });
        line.pings[0] = waterfall.pings[row];
        const Picture one = renderer.render(line);
        CHECK(std::equal(one.pixels.begin(), one.pixels.end(),
                         all.pixels.begin() + (6 - static_cast<std::ptrdiff_t>(row)) * 200));
      }
    }
}

TEST_CASE("Viridis goes from violet to yellow and always gets lighter") {
  double before = 0.0;
  for (int i = 0; i <= 255; ++i) {
    const auto colour = colour_of(Palette::viridis, i / 255.0);
    const double light = 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2];
    CHECK(light > before);
    before = light;
  }
  const auto low = colour_of(Palette::viridis, 0.0), high = colour_of(Palette::viridis, 1.0);
  CHECK(low[0] == Approx(0.267).margin(0.015));
  CHECK(low[2] == Approx(0.329).margin(0.015));
  CHECK(high[0] == Approx(0.993).margin(0.03));
  CHECK(high[1] == Approx(0.906).margin(0.015));
}

TEST_CASE("A painted picture has the colour of each brightness, in 8 and in 16 bits") {
  for (const Palette palette :
       {Palette::grey, Palette::copper, Palette::bronze, Palette::paper, Palette::viridis})
    for (const int bits : {8, 16}) {
      Picture ramp{256, 1, 1, {}, bits};
      for (int i = 0; i < 256; ++i)  // 16 bits: 257 times the step
        for (int byte = 0; byte < bits / 8; ++byte)
          ramp.pixels.push_back(static_cast<std::uint8_t>(i));
      const Picture picture = painted(ramp, palette);
      CAPTURE(static_cast<int>(palette), bits);
      const bool grey = palette == Palette::grey || palette == Palette::paper;
      REQUIRE(picture.channels == (grey ? 1 : 3));
      const std::uint8_t* pixel = picture.pixels.data();
      for (int i = 0; i < 256; ++i)
        for (std::size_t k = 0; k < static_cast<std::size_t>(picture.channels); ++k) {
          int value = *pixel++;
          if (bits == 16) value = 256 * value + *pixel++;
          const double full = bits == 16 ? 65535.0 : 255.0;
          REQUIRE(value == std::lround(full * colour_of(palette, i / 255.0)[k]));
        }
    }
}
