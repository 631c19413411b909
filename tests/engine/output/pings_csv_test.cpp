#include <ensonify/engine/output/pings_csv.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/sample_waterfall.h"
#include "support/settings.h"

using namespace ensonify::engine;
using ensonify::tests::OtherSettings;
using ensonify::tests::sample_waterfall;

namespace {

std::vector<std::vector<std::string>> table(const std::string& csv) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    rows.emplace_back();
    std::istringstream cells(line + ',');
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

}  // namespace

TEST_CASE("There is one row per ping with the documented columns, and numbers read back exactly") {
  Waterfall waterfall = sample_waterfall(3);
  waterfall.pings[1].altitude_m = std::numeric_limits<double>::quiet_NaN();
  waterfall.pings[1].lines[0].first_return = -1;
  waterfall.pings[2].lines[1].first_return = 0;
  const std::string csv = pings_csv(waterfall);
  CHECK(
      csv.find("ping,t_s,x_m,y_m,z_m,roll_deg,pitch_deg,heading_deg,reported_x_m,reported_y_m,"
               "reported_z_m,reported_roll_deg,reported_pitch_deg,reported_heading_deg,altitude_m,"
               "first_return_port,first_return_starboard,block,starved_port,starved_starboard,"
               "artefacts\n") == 0);
  const auto rows = table(csv);
  REQUIRE(rows.size() == 4);
  for (std::size_t i = 1; i < rows.size(); ++i) {
    REQUIRE(rows[i].size() == 21);
    CHECK(rows[i][0] == std::to_string(i - 1));
    CHECK(std::stod(rows[i][1]) == waterfall.pings[i - 1].pose.t_s);
    for (const std::size_t first : {2u, 8u}) {
      const PingRow& record = waterfall.pings[i - 1];
      const Pose& pose = first == 2u ? record.pose : record.reported;
      for (std::size_t k = 0; k < 3; ++k)
        CHECK(std::stod(rows[i][first + k]) == pose.position[static_cast<Eigen::Index>(k)]);
      CHECK(std::stod(rows[i][first + 3]) * std::numbers::pi / 180 ==
            Approx(pose.roll_rad).epsilon(1e-15));
      CHECK(std::stod(rows[i][first + 4]) * std::numbers::pi / 180 ==
            Approx(pose.pitch_rad).epsilon(1e-15));
      CHECK(std::stod(rows[i][first + 5]) * std::numbers::pi / 180 ==
            Approx(pose.heading_rad).epsilon(1e-15));
    }
    CHECK(rows[i][20].empty());
  }
  CHECK(rows[1][14] == "10.5");
  CHECK(rows[1][15] == "3");
  CHECK(rows[1][16] == "5");
  CHECK(rows[1][17] == "0");
  CHECK(rows[1][18] == "1");
  CHECK(rows[1][19] == "0");
  CHECK(rows[2][14].empty());
  CHECK(rows[2][15].empty());
  CHECK(rows[3][16] == "0");
}

TEST_CASE("Headings of a pings file are those of a compass, from 0 up to 360 degrees") {
  Waterfall waterfall = sample_waterfall(4);
  const std::vector<double> given_deg{-10.0, 370.0, 360.0, -1e-20},
      expected_deg{350.0, 10.0, 0.0, 0.0};
  for (std::size_t i = 0; i < 4; ++i) {
    waterfall.pings[i].pose.heading_rad = given_deg[i] * std::numbers::pi / 180.0;
    waterfall.pings[i].reported.heading_rad = (given_deg[i] - 720.0) * std::numbers::pi / 180.0;
  }
  const auto rows = table(pings_csv(waterfall));
  for (std::size_t i = 0; i < 4; ++i)
    for (const std::size_t column : {7u, 13u}) {
      const double heading_deg = std::stod(rows[1 + i][column]);
      CAPTURE(i, column, heading_deg);
      CHECK(heading_deg >= 0.0);
      CHECK(heading_deg < 360.0);
      CHECK(std::remainder(heading_deg - expected_deg[i], 360.0) == Approx(0.0).margin(1e-9));
    }
}

TEST_CASE("A pings file has the same bytes in another locale") {
  const Waterfall waterfall = sample_waterfall();
  const std::string csv = pings_csv(waterfall);
  const OtherSettings other;
  CHECK(pings_csv(waterfall) == csv);
}
