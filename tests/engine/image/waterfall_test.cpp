#include <ensonify/engine/image/waterfall.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <thread>
#include <vector>

#include "support/catch.h"

using namespace ensonify::engine;

namespace {

EchoLine line(std::size_t sector, std::size_t bins, float first) {
  EchoLine line;
  line.sector = sector;
  line.bins.assign(bins);
  for (std::size_t i = 0; i < bins; ++i) {
    line.bins.intensity[i] = first + static_cast<float>(i);
    line.bins.region[i] = static_cast<std::uint32_t>(i);
  }
  return line;
}

}  // namespace

TEST_CASE("A row has port from far to near, then starboard from near to far") {
  Sonar sonar;
  sonar.bins = 3;
  Waterfall waterfall(sonar, 2);
  CHECK(waterfall.rows() == 2);
  CHECK(waterfall.columns() == 6);
  PingRow record;
  record.block = 9;
  // The sides are given in either order.
  std::vector sides = {line(1, 3, 20), line(0, 3, 10)};
  sides[0].first_return = 2;
  sides[1].starved = 7;
  waterfall.set_row(1, sides, record);
  CHECK(waterfall.pixels.intensity == std::vector<float>{0, 0, 0, 0, 0, 0, 12, 11, 10, 20, 21, 22});
  CHECK(waterfall.pixels.region == std::vector<std::uint32_t>{0, 0, 0, 0, 0, 0, 2, 1, 0, 0, 1, 2});
  CHECK(waterfall.pings[1].block == 9);
  CHECK(waterfall.pings[1].lines[1].first_return == 2);
  CHECK(waterfall.pings[1].lines[0].first_return == -1);
  CHECK(waterfall.pings[1].lines[0].starved == 7);
  CHECK(waterfall.pings[1].lines[1].starved == 0);
  CHECK(waterfall.pings[0].block == 0);
}

TEST_CASE("A sonar with one side has only that side's columns and lines") {
  Sonar sonar;
  sonar.bins = 3;
  sonar.sides = Sides::port;
  Waterfall port(sonar, 1);
  CHECK(port.columns() == 3);
  port.set_row(0, std::vector{line(0, 3, 10)}, {});
  CHECK(port.pixels.intensity == std::vector<float>{12, 11, 10});
  CHECK(port.pings[0].lines[1].first_return == -1);
  CHECK_THROWS_AS(port.set_row(0, std::vector{line(1, 3, 0)}, {}), std::invalid_argument);
  sonar.sides = Sides::starboard;
  Waterfall starboard(sonar, 1);
  starboard.set_row(0, std::vector{line(0, 3, 20)}, {});
  CHECK(starboard.pixels.intensity == std::vector<float>{20, 21, 22});
}

TEST_CASE("A row that does not fit the waterfall is refused") {
  Sonar sonar;
  sonar.bins = 3;
  Waterfall waterfall(sonar, 2);
  CHECK_THROWS_AS(waterfall.set_row(2, {}, {}), std::invalid_argument);
  CHECK_THROWS_AS(waterfall.set_row(0, std::vector{line(0, 4, 0)}, {}), std::invalid_argument);
  CHECK_THROWS_AS(waterfall.set_row(0, std::vector{line(0, 2, 0)}, {}), std::invalid_argument);
}

TEST_CASE("Rows set from several threads equal rows set from one") {
  Sonar sonar;
  sonar.bins = 50;
  const auto set = [](Waterfall& waterfall, std::size_t row) {
    waterfall.set_row(row, std::vector{line(0, 50, static_cast<float>(row)), line(1, 50, 1)}, {});
  };
  Waterfall one(sonar, 64), several(sonar, 64);
  for (std::size_t row = 0; row < 64; ++row) set(one, row);
  {
    std::vector<std::jthread> threads;
    for (std::size_t k = 0; k < 4; ++k)
      threads.emplace_back([&, k] {
        for (std::size_t row = k; row < 64; row += 4) set(several, row);
      });
  }
  CHECK(one.pixels.intensity == several.pixels.intensity);
}

TEST_CASE("A sonar's altitude is its vehicle's, less what its mounting puts it below") {
  Waterfall waterfall({}, 1);
  PingRow& ping = waterfall.pings[0];
  ping.pose.position = {3.0, 4.0, -10.1};
  ping.altitude_m = 9.7;
  CHECK(waterfall.sonar_altitude_m(0) == 9.7);  // to the bit, without a mounting
  waterfall.sonar.mounting.down_m = 3.0;
  CHECK(waterfall.sonar_altitude_m(0) == Approx(6.7));
  waterfall.sonar.mounting = {.forward_m = 4.0, .starboard_m = 2.0};
  ping.pose.pitch_rad = std::numbers::pi / 6.0;  // lifts the nose
  CHECK(waterfall.sonar_altitude_m(0) == Approx(11.7));
  ping.pose.pitch_rad = 0.0;
  ping.pose.roll_rad = std::numbers::pi / 6.0;  // lowers the starboard side
  CHECK(waterfall.sonar_altitude_m(0) == Approx(8.7));
  ping.altitude_m = std::nan("");  // over a hole
  CHECK(std::isnan(waterfall.sonar_altitude_m(0)));
}
