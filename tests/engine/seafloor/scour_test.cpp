#include <ensonify/engine/seafloor/objects/scour.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/seafloor/make_seafloor.h>

using namespace ensonify::engine;

namespace {

/// A box on a level bed, in a current to the east.
ObjectOptions scoured_box(double scour_ratio, double tail_ratio) {
  ObjectOptions box;
  box.shape = "box";
  box.size.length_m = 6.0;
  box.size.width_m = 3.0;
  box.size.shape_height_m = 2.0;
  box.scour_ratio = scour_ratio;
  box.tail_ratio = tail_ratio;
  box.current_rad = 0.5 * std::numbers::pi;
  return box;
}

SeafloorOptions level_bed() {
  SeafloorOptions bed;
  bed.extent_east_m = bed.extent_north_m = 60.0;
  bed.cell_m = 0.2;
  bed.depth_m = 15.0;
  bed.fractal.height_at_1m_m = 0.0;
  return bed;
}

/// What the current has added to the bed under a place.
double moved_m(const BedGrid& grid, double x_m, double y_m) {
  return grid.height_m(x_m, y_m) + 15.0;
}

struct Place {
  double x_m, y_m;
};

/// What was moved at places: the mean over seeds, so that the random share has its mean of 1.
std::vector<double> mean_moved_m(const ObjectOptions& box, const std::vector<Place>& places) {
  constexpr int seeds = 60;
  std::vector<double> means_m(places.size());
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Seafloor seafloor = make_seafloor(level_bed(), seed, std::vector{box}, {});
    const BedGrid grid(seafloor);
    for (std::size_t i = 0; i < places.size(); ++i)
      means_m[i] += moved_m(grid, places[i].x_m, places[i].y_m) / seeds;
  }
  return means_m;
}

}  // namespace

TEST_CASE("a moat has its depth a half height from an object, and is half as deep in the lee") {
  const ObjectOptions box = scoured_box(0.1, 0.0);
  // Upstream, beside and downstream; the box reaches to 1.5 m east and 3 m north. Places of the
  // grid, which has a point in the middle.
  const std::vector<double> moved = mean_moved_m(box, {{-2.6, 0.0}, {0.0, 4.0}, {2.6, 0.0}});
  CHECK(moved[0] == Approx(-0.2).epsilon(0.15));
  CHECK(moved[1] == Approx(-0.15).epsilon(0.15));
  CHECK(moved[2] == Approx(-0.1).epsilon(0.15));
}

TEST_CASE("an object much longer than the bed is not scoured, and takes no time") {
  ObjectOptions box = scoured_box(0.1, 0.1);
  box.scale = 1e6;
  const Seafloor seafloor = make_seafloor(level_bed(), 1, std::vector{box}, {});
  CHECK(moved_m(BedGrid(seafloor), -20.0, 10.0) == Approx(0.0).margin(1e-6));
}

TEST_CASE("the wall of a deep moat is no steeper than sand stands") {
  const ObjectOptions box = scoured_box(0.5, 0.0);  // 1 m deep
  std::vector<Place> places;
  for (double from_m = 0.0; from_m < 12.0; from_m += 0.2) places.push_back({-1.6 - from_m, 0.0});
  const std::vector<double> moved = mean_moved_m(box, places);
  CHECK(std::ranges::min(moved) == Approx(-1.0).epsilon(0.15));
  double steepest = 0.0;
  for (std::size_t i = 1; i < moved.size(); ++i)
    steepest = std::max(steepest, std::abs(moved[i] - moved[i - 1]) / 0.2);
  CHECK(steepest > 0.4);
  CHECK(steepest < std::tan(33.0 * std::numbers::pi / 180.0) * 1.1);
}

TEST_CASE("what lies under an object and far from it stays, and so does the object") {
  const SeafloorOptions bed = level_bed();
  const Seafloor plain = make_seafloor(bed, 1, std::vector{scoured_box(0.0, 0.0)}, {});
  const Seafloor scoured = make_seafloor(bed, 1, std::vector{scoured_box(0.3, 0.3)}, {});
  const BedGrid grid(scoured);
  CHECK(moved_m(grid, 0.0, 0.0) == Approx(0.0).margin(1e-5));
  CHECK(moved_m(grid, 1.0, 2.0) == Approx(0.0).margin(1e-5));
  CHECK(moved_m(grid, -20.0, 0.0) == Approx(0.0).margin(1e-5));
  CHECK(moved_m(grid, 0.0, 14.0) == Approx(0.0).margin(1e-5));
  CHECK(moved_m(grid, -2.6, 0.0) < -0.1);
  CHECK(scoured.objects[0].middle_m == plain.objects[0].middle_m);
  CHECK(scoured.faces == plain.faces);
}

TEST_CASE("a moat leaves what other objects stand on, with a slope of sand around it") {
  const SeafloorOptions bed = level_bed();
  ObjectOptions crate;
  crate.shape = "box";
  crate.east_m = -3.5;
  crate.heading_rad = 0.4;
  ObjectOptions pipe;
  pipe.shape = "pipeline";
  pipe.path = {{-6.0, -5.0}, {5.0, -4.5}};
  pipe.burial = 0.6;
  ObjectOptions buoy = crate;  // moored
  buoy.north_m = 3.0;
  buoy.height_m = 5.0;
  const std::vector objects{scoured_box(0.4, 0.0), crate, pipe, buoy};
  const Heightfield scoured = make_heightfield(bed, 1, objects);
  const Seafloor before = make_seafloor(bed, 1, {}, {});
  const PlacedObjects placed = place_objects(objects, 1, BedGrid(before));
  const auto moved = [&](double x_m, double y_m) {
    const auto at = [](double m, int points) { return m / 0.2 + 0.5 * (points - 1); };
    const double column = at(x_m, scoured.columns), row = at(y_m, scoured.rows);
    double most_m = 0.0;  // of the four points around a place
    for (const double c : {std::floor(column), std::ceil(column)})
      for (const double r : {std::floor(row), std::ceil(row)})
        most_m = std::min(most_m, scoured.at(static_cast<int>(c), static_cast<int>(r)) + 15.0);
    return most_m;
  };
  for (const std::size_t standing : {1u, 2u})
    for (const Eigen::Vector3f& p : placed.objects[standing].mesh.positions)
      CHECK(moved(p.x(), p.y()) == Approx(0.0).margin(1e-9));
  CHECK(moved(buoy.east_m, buoy.north_m) < -0.3);
  CHECK(moved(-3.5, -1.6) < -0.3);  // between the crate and the pipe
  double steepest = 0.0;
  for (int row = 1; row < scoured.rows; ++row)
    for (int column = 1; column < scoured.columns; ++column)
      if (std::abs(scoured.x_m(column) + 3.5) < 1.5 && std::abs(scoured.y_m(row)) < 1.5)
        steepest = std::max(
            {steepest, std::abs(scoured.at(column, row) - scoured.at(column - 1, row)) / 0.2,
             std::abs(scoured.at(column, row) - scoured.at(column, row - 1)) / 0.2});
  CHECK(steepest < 1.3 * 0.62);  // the moat itself changes at random
}

TEST_CASE("the moat of a long object is half as deep in the lee all along it") {
  ObjectOptions wall = scoured_box(0.1, 0.0);
  wall.size.length_m = 40.0;
  wall.size.width_m = 1.0;
  const std::vector<double> moved = mean_moved_m(
      wall, {{-1.6, -16.0}, {1.6, -16.0}, {-1.6, 0.0}, {1.6, 0.0}, {-1.6, 16.0}, {1.6, 16.0}});
  for (std::size_t i = 0; i < moved.size(); i += 2) {
    CHECK(moved[i] == Approx(-0.2).epsilon(0.15));
    CHECK(moved[i + 1] == Approx(-0.1).epsilon(0.15));
  }
}

TEST_CASE("the heights of a bed have the scours of its objects, and not the objects") {
  const SeafloorOptions bed = level_bed();
  for (const ObjectOptions& box : {scoured_box(0.3, 0.3), scoured_box(0.0, 0.0)}) {
    const std::vector objects{box};
    const Heightfield field = make_heightfield(bed, 1, objects);
    const Seafloor seafloor = make_seafloor(bed, 1, objects);
    const BedGrid grid(seafloor);
    for (int row = 0; row < field.rows; row += 7)
      for (int column = 0; column < field.columns; column += 7)
        REQUIRE(field.at(column, row) ==
                Approx(grid.height_m(field.x_m(column), field.y_m(row))).epsilon(0).margin(1e-5));
    const auto [low, high] = std::ranges::minmax(field.z_m);
    CHECK((high - low > 0.3) == (box.scour_ratio > 0.0));
    CHECK(high < -14.0);
  }
}

TEST_CASE("the tail lies in the lee and is highest a quarter of its length away") {
  const ObjectOptions box = scoured_box(0.0, 0.2);
  const std::vector<double> moved =
      mean_moved_m(box, {{1.5 + 3.0, 0.0}, {-4.6, 0.0}, {1.5 + 12.4, 0.0}});
  CHECK(moved[0] == Approx(0.4).epsilon(0.15));
  CHECK(moved[1] == Approx(0.0).margin(1e-5));
  CHECK(moved[2] == Approx(0.0).margin(1e-5));
}

TEST_CASE("scours are refused where the bed is a mesh") {
  const ensonify::tests::TemporaryFolder folder;
  SeafloorOptions bed = level_bed();
  bed.kind = SeafloorKind::mesh;
  bed.mesh.path = folder / "bed.obj";
  ensonify::tests::write_text(bed.mesh.path,
                              "v -9 -9 -5\nv 9 -9 -5\nv 9 9 -5\nv -9 9 -5\nf 1 2 3\nf 1 3 4\n");
  CHECK_THROWS_WITH(make_seafloor(bed, 1, std::vector{scoured_box(0.1, 0.0)}, {}),
                    Catch::Contains("scour_ratio"));
}
