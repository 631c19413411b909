#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/seafloor/seafloor_in_tiles.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include <ensonify/refine/height_grid.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/grids.h"
#include "support/message.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;
using ensonify::refine::MeshError;

namespace {

SeafloorOptions small() {
  SeafloorOptions options;
  options.extent_east_m = 20.0;
  options.extent_north_m = 12.0;
  options.cell_m = 0.25;
  options.depth_m = 15.0;
  return options;
}

std::string message_of(const SeafloorOptions& options) {
  return message_thrown<std::exception>([&] { make_seafloor(options, 1); });
}

}  // namespace

TEST_CASE("A generated seafloor has the requested extent, cells and mean depth") {
  SeafloorOptions options = small();
  options.ripples.rms_height_m = 0.02;
  options.ripples.wavelength_m = 1.5;
  const Heightfield field = make_heightfield(options, 3);
  CHECK(field.columns == 81);
  CHECK(field.rows == 49);
  CHECK(field.x_m(0) == Approx(-10.0));
  CHECK(field.y_m(48) == Approx(6.0));
  CHECK(field.world_origin == Eigen::Vector3d::Zero());
  CHECK(std::accumulate(field.z_m.begin(), field.z_m.end(), 0.0) / (81 * 49) ==
        Approx(-15.0).epsilon(1e-9));
  const auto [low, high] = std::minmax_element(field.z_m.begin(), field.z_m.end());
  CHECK(*high - *low > 0.05);

  const Seafloor bed = make_seafloor(options, 3);
  CHECK(bed.mesh.positions.size() == 81 * 49);
  CHECK(bed.mesh.faces.size() == 2 * 80 * 48);
  REQUIRE(bed.labels.size() == 1);
  CHECK(bed.labels[0].sediment == 1);
  CHECK(bed.labels[0].class_id == 1);
  CHECK(bed.labels[0].instance == 0);
  CHECK(bed.label_of(7) == 0);
}

TEST_CASE("Relief and ripples are added, and neither changes the other") {
  SeafloorOptions both = small(), relief = small(), ripples = small();
  both.ripples.rms_height_m = ripples.ripples.rms_height_m = 0.03;
  ripples.fractal.height_at_1m_m = 0.0;
  const Heightfield a = make_heightfield(both, 9), b = make_heightfield(relief, 9),
                    c = make_heightfield(ripples, 9);
  for (std::size_t i = 0; i < a.z_m.size(); ++i)
    REQUIRE(a.z_m[i] + 15.0 == Approx(b.z_m[i] + 15.0 + c.z_m[i] + 15.0).margin(1e-12));
}

TEST_CASE("A generated bed slopes down in its direction, at once and in tiles") {
  SeafloorOptions level = small(), sloping = small();
  sloping.slope_rad = 0.1;
  sloping.downhill_rad = 2.0;  // to the south-east
  const Heightfield a = make_heightfield(level, 9), b = make_heightfield(sloping, 9);
  for (const int column : {0, 40, 80})
    for (const int row : {0, 24, 48}) {
      const double downhill_m = a.x_m(column) * std::sin(2.0) + a.y_m(row) * std::cos(2.0);
      CHECK(b.at(column, row) - a.at(column, row) ==
            Approx(-std::tan(0.1) * downhill_m).margin(1e-12));
    }
  // Tiles have other relief: without it they have the same heights.
  sloping.fractal.height_at_1m_m = 0.0;
  const Seafloor at_once = make_seafloor(sloping, 9, {}, {}, {}, BedForm::grid);
  const Seafloor in_tiles = make_seafloor_in_tiles(sloping, 9, {}, {}, {});
  CHECK(at_once.grid->mesh().positions == in_tiles.grid->mesh().positions);
  CHECK(at_once.mean_bed_m == Approx(-15.0).epsilon(1e-6));
  CHECK(in_tiles.mean_bed_m == -15.0);
}

TEST_CASE("Impossible seafloor options are refused by name") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double wrong : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
    SeafloorOptions options = small();
    options.extent_east_m = wrong;
    CHECK(message_of(options).find("extent to the east") != std::string::npos);
    options = small();
    options.extent_north_m = wrong;
    CHECK(message_of(options).find("extent to the north") != std::string::npos);
    options = small();
    options.cell_m = wrong;
    CHECK(message_of(options).find("cell") != std::string::npos);
    options = small();
    options.depth_m = wrong;
    CHECK(message_of(options).find("depth") != std::string::npos);
  }
  SeafloorOptions options = small();
  for (const double wrong : {1.6, -1.6, nan}) {
    options.slope_rad = wrong;
    CHECK(message_of(options).find("less than a right angle") != std::string::npos);
  }
  options = small();
  options.cell_m = 30.0;
  CHECK(message_of(options).find("no cell") != std::string::npos);
  options = small();
  options.cell_m = 1e-6;
  CHECK(message_of(options).find("2^31") != std::string::npos);
  options.cell_m = 1e-300;
  CHECK(message_of(options).find("2^31") != std::string::npos);
}

TEST_CASE("A bed that would rise above the sea is refused, with the height to which it rises") {
  SeafloorOptions options = small();
  options.fractal.height_at_1m_m = 5.0;
  options.depth_m = 2.0;
  CHECK_THROWS_AS(make_seafloor(options, 1), std::invalid_argument);
  CHECK(message_of(options).find(" m above the sea surface") != std::string::npos);
  options = small();
  options.slope_rad = 1.0;  // a rise of 1.56 m per metre, and 6 m to the southern border
  CHECK_NOTHROW(make_seafloor(options, 1));
  options.downhill_rad = 1.5708;  // and 10 m to the western one
  CHECK(message_of(options).find("the slope lower") != std::string::npos);
}

TEST_CASE(
    "A survey becomes a seafloor below its water level, and is refused if all of it lies above") {
  const TemporaryFolder folder;
  const std::string grid =
      "ncols 3\nnrows 2\nxllcorner 1000\nyllcorner 2000\ncellsize 2\nNODATA_value -9999\n"
      "372.5 373 374\n371 372 -9999\n";
  write_text(folder / "river.asc", grid);
  SeafloorOptions options;
  options.kind = SeafloorKind::survey;
  options.survey.path = folder / "river.asc";
  CHECK_THROWS_AS(make_seafloor(options, 1), MeshError);
  CHECK(message_of(options).find("water_level_m") != std::string::npos);
  options.water_level_m = 375.0;
  const Seafloor bed = make_seafloor(options, 1);
  CHECK(bed.mesh.faces.size() == 2);
  CHECK(bed.mesh.positions.front().z() == -4.0f);
  CHECK(bed.mesh.world_origin == Eigen::Vector3d(1003.0, 2002.0, 375.0));
  // One wrong height is no sea.
  std::string positive = "ncols 50\nnrows 40\nxllcorner 0\nyllcorner 0\ncellsize 1\n-0.1";
  for (int i = 1; i < 2000; ++i) positive += " 12.5";
  write_text(folder / "depths.asc", positive + '\n');
  options.survey.path = folder / "depths.asc";
  options.water_level_m = 0.0;
  CHECK(message_of(options).find("the whole survey lies above the sea surface, except 0.05 % of "
                                 "its points") != std::string::npos);
}
