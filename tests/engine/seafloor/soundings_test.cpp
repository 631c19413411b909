#include <ensonify/engine/seafloor/bed/soundings.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed/survey.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/files.h"
#include "support/surveys.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

TEST_CASE("soundings that lie on a plane make that plane, with holes where there are none") {
  const TemporaryFolder folder;
  std::string text = "\xEF\xBB\xBF# a survey\r\nx,y,z\r\n";
  const auto height = [](double x, double y) {
    return -20.0 + 0.1 * (x - 500000.0) - 0.2 * (y - 6200000.0);
  };
  for (int i = 0; i < 4000; ++i) {
    // Not on a lattice; nothing from 12 to 20 m east.
    const double x = 500000.0 + std::fmod(0.754877666 * i, 1.0) * 24.0;
    const double y = 6200000.0 + std::fmod(0.569840291 * i, 1.0) * 10.0;
    if (x > 500012.0 && x < 500020.0) continue;
    std::array<char, 100> line{};
    std::snprintf(line.data(), line.size(), "%.4f, %.4f, %.5f, 7\r\n", x, y, height(x, y));
    text += line.data();
  }
  write_text(folder / "a.xyz", text);
  const Heightfield field = read_survey({folder / "a.xyz", 0.5}, 0.0);
  CHECK(field.columns == 48);
  CHECK(field.rows == 20);
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) {
      const double x = field.x_m(column) + field.world_origin.x(),
                   y = field.y_m(row) + field.world_origin.y();
      CAPTURE(x - 500000.0, y - 6200000.0);
      const double z = field.at(column, row);
      if (x > 500013.1 && x < 500018.9)
        CHECK(std::isnan(z));
      else if (row > 0 && row + 1 < field.rows && column > 0 && column + 1 < field.columns &&
               (x < 500012.9 || x > 500019.1))
        CHECK(z == Approx(height(x, y)).epsilon(0).margin(1e-4));
      else
        CHECK((std::isnan(z) || std::abs(z - height(x, y)) < 0.3));  // no triangle outside
    }
  // The same by windows, and the header without heights.
  std::vector<double> window(1);
  survey_tiles({folder / "a.xyz", 0.5}, 0.0)(5, 6, 1, 1, window, {});
  CHECK(window[0] == field.at(5, 6));
  CHECK(read_survey_header({folder / "a.xyz", 0.5}).columns == 48);
}

TEST_CASE("faults of soundings are named with their line") {
  const TemporaryFolder folder;
  const std::string good = "0 0 -5\n3 0 -6\n0 3 -7\n3 3 -8\n";
  const auto fault = [&](const std::string& text, const std::string& part, double cell_m = 1.0) {
    CHECK(has(survey_error(folder, text, "a.txt", cell_m), part));
  };
  CHECK(survey_error(folder, good, "a.txt", 1.0).empty());
  fault(good, "set seafloor.survey_cell_m", 0.0);
  fault(good + "4 4\n", "line 5: '4 4' does not begin with three numbers");
  fault(good + "4 4 nan\n", "line 5");
  fault(good + "4 4 -5m\n", "line 5");
  fault("east north up\n" + good + "east north up\n", "line 6");
  fault(good + "1e6 1e6 -5\n", "soundings that lie far off");
  fault(good, "fewer than 2 x 2 cells", 10.0);
  fault("0 0 -5\n1 1 -6\n2 2 -7\n3 3 -8\n", "on one line");
  fault(good + "2 2 99999\n", "line 5: a height of 99999 m");
}

TEST_CASE("the first line of soundings names their columns, in any order") {
  const TemporaryFolder folder;
  const auto read_text = [&](const std::string& text) {
    write_text(folder / "a.txt", text);
    return read_survey({folder / "a.txt", 1.0}, 0.0);
  };
  const Heightfield expected = read_text("0 0 -5\n3 0 -6\n0 5 -7\n3 5 -8\n");
  for (const std::string text :
       {"northing,easting,depth\n0,0,-5\n0,3,-6\n5,0,-7\n5,3,-8\n",
        "id;X (m);Y (m);Z (m)\nA 1;0;0;-5\n;3;0;-6\nc;0;5;-7\nd;3;5;-8\n",
        "\"Depth_m\"\tEast\tNorth\n-5\t0\t0\n-6\t3\t0\n-7\t0\t5\n-8\t3\t5\n",
        "a b c\n0 0 -5\n3 0 -6\n0 5 -7\n3 5 -8\n"}) {
    CAPTURE(text);
    const Heightfield field = read_text(text);
    CHECK(field.columns == expected.columns);
    CHECK(field.rows == expected.rows);
    CHECK(field.at(1, 1) == Approx(expected.at(1, 1)));
  }
  const auto fault = [&](const std::string& text, const std::string& part) {
    CHECK(has(survey_error(folder, text, "a.txt", 1.0), part));
  };
  for (const char* const header :
       {"id,east,north", "a,b,c,d", "lon,lat,depth", "x,y,depth_ft,z_ft"})
    fault(header + std::string("\n0,0,-5,1\n3,0,-6,1\n0,5,-7,1\n"), "line 1: '");
  for (const char* const header : {"x_ft,y_ft,z_ft", "x,y,z (feet)", "east,north,depth_fathoms"})
    fault(header + std::string("\n0,0,-5\n3,0,-6\n0,5,-7\n"), "line 1: '");
  fault("x;y;z\n0,5;0;-5\n", "line 2: has commas inside its fields");
  fault("0,5 1,5 -5,5\n3 0 -6\n", "line 1: has commas inside its fields");
  fault("x,y,z\n0,0,-5\n3,,-6\n", "line 3: '3,,-6' has no numbers x y z where the first line");
  fault("0 0 -9999\n3 0 -6\n0 3 -7\n", "line 1: a height of -9999 m");
}

TEST_CASE("real soundings on a grid are those that their surveyors' grid has") {
  const auto soundings = data_file("bathymetry/colorado_river_mbes_100k.xyz"),
             grid = data_file("bathymetry/colorado_river_0.25m.asc");
  if (!soundings || !grid) {
    WARN("skipped: the river's survey is not there");
    return;
  }
  const Heightfield ours = read_survey({*soundings, 0.25}, 370.0),
                    theirs = read_survey(*grid, 370.0);
  std::vector<double> apart_m;
  for (int row = 0; row < ours.rows; ++row)
    for (int column = 0; column < ours.columns; ++column) {
      const auto at = [&](double place, double origin, double step, int count) {
        return std::clamp(static_cast<int>(std::lround((place - origin) / step)), 0, count - 1);
      };
      const int c = at(ours.x_m(column) + ours.world_origin.x(),
                       theirs.x_m(0) + theirs.world_origin.x(), 0.25, theirs.columns),
                r = at(ours.y_m(row) + ours.world_origin.y(),
                       theirs.y_m(0) + theirs.world_origin.y(), 0.25, theirs.rows);
      const double difference = ours.at(column, row) - theirs.at(c, r);
      if (!std::isnan(difference)) apart_m.push_back(std::abs(difference));
    }
  REQUIRE(apart_m.size() > 5000);
  std::ranges::sort(apart_m);
  INFO("median " << apart_m[apart_m.size() / 2] << " 95 % " << apart_m[apart_m.size() * 95 / 100]);
  CHECK(apart_m[apart_m.size() / 2] < 0.02);
  CHECK(apart_m[apart_m.size() * 95 / 100] < 0.1);
  CHECK(std::abs(valid_share(ours) * ours.columns * ours.rows /
                     (valid_share(theirs) * theirs.columns * theirs.rows) -
                 1.0) < 0.15);
}

TEST_CASE("damaged soundings are read or refused, and nothing else happens") {
  const TemporaryFolder folder;
  CHECK(refused_when_damaged(folder, "0 0 -5\n3 0 -6\n0 3 -7\n3 3 -8\n1.5 1 -7.5\n", "a.xyz", 1.0) >
        40);
}
