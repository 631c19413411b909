#include <ensonify/engine/image/fan_picture.h>

#include <cmath>

#include "support/catch.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/sonar/instrument/presets.h>

using namespace ensonify::engine;

namespace {

Sonar fan_sonar(BeamSteps steps) {
  Sonar sonar = usual_sonar(SonarKind::imaging);
  sonar.beams = 61;
  sonar.bins = 200;
  sonar.range_m = 20.0;
  sonar.field_of_view_rad = 120.0 * degree;
  sonar.beam_steps = steps;
  return sonar;
}

}  // namespace

TEST_CASE("A fan picture shows a bright beam and a bright range where they are") {
  for (const BeamSteps steps : {BeamSteps::angle, BeamSteps::sine}) {
    const Sonar sonar = fan_sonar(steps);
    // Two pings, the newest on top; in the older one a single bright bin.
    constexpr std::size_t beams = 61, bins = 200, bright_beam = 45, bright_bin = 149;
    Picture waterfall{.width = bins, .height = 2 * beams, .pixels = {}};
    waterfall.pixels.assign(bins * 2 * beams, 40);
    waterfall.pixels[(2 * beams - 1 - bright_beam) * bins + bright_bin] = 255;
    const FanPicture fan(sonar);
    const Picture newer = fan.draw(waterfall, 1), older = fan.draw(waterfall, 0);
    CHECK(older.height == bins);  // a pixel is a bin
    CHECK(older.width == 2 * std::size_t(std::ceil(std::sin(60.0 * degree) * 200.0)));
    for (const std::uint8_t value : newer.pixels) REQUIRE((value == 0 || value == 40));
    const auto brightest = std::ranges::max_element(older.pixels) - older.pixels.begin();
    const auto row = static_cast<double>(brightest / std::ptrdiff_t(older.width)),
               column = static_cast<double>(brightest % std::ptrdiff_t(older.width));
    const double bearing_rad = sonar.bearing_rad(bright_beam);
    CHECK(bearing_rad > 0.0);  // to starboard
    CHECK(200.0 - row - 0.5 == Approx(149.5 * std::cos(bearing_rad)).margin(1.0));
    CHECK(column + 0.5 - 0.5 * double(older.width) ==
          Approx(149.5 * std::sin(bearing_rad)).margin(2.0));
    // Outside the field of view it is black.
    CHECK(older.pixels[(older.height - 1) * older.width] == 0);
    CHECK(older.pixels[0] == 0);
  }
}

TEST_CASE("A fan picture keeps colours and 16 bits, and refuses another sonar's picture") {
  const FanPicture fan(fan_sonar(BeamSteps::angle));
  Picture colours{.width = 200, .height = 61, .channels = 3, .pixels = {}};
  for (std::size_t i = 0; i < 200 * 61; ++i)
    for (const std::uint8_t value : {10, 20, 30}) colours.pixels.push_back(value);
  const Picture in_colour = fan.draw(colours, 0);
  const std::size_t middle = 3 * ((in_colour.height / 2) * in_colour.width + in_colour.width / 2);
  CHECK(in_colour.pixels[middle] == 10);
  CHECK(in_colour.pixels[middle + 2] == 30);
  Picture deep{.width = 200, .height = 61, .pixels = {}, .bits = 16};
  for (std::size_t i = 0; i < 200 * 61; ++i)
    for (const std::uint8_t value : {1, 200}) deep.pixels.push_back(value);
  const Picture in_16_bits = fan.draw(deep, 0);
  const std::size_t at = 2 * ((in_16_bits.height / 2) * in_16_bits.width + in_16_bits.width / 2);
  CHECK(in_16_bits.pixels[at] == 1);
  CHECK(in_16_bits.pixels[at + 1] == 200);
  CHECK_THROWS_AS(fan.draw(colours, 1), std::invalid_argument);
  colours.width = 100;
  CHECK_THROWS_AS(fan.draw(colours, 0), std::invalid_argument);
}
