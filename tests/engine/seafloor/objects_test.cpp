#include <ensonify/engine/seafloor/objects/objects.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <vector>

#include "support/beds.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/seafloor/objects/laid_line.h>
#include <ensonify/engine/seafloor/objects/shapes.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector2d, Eigen::Vector3d;

namespace {

/// A plane bed with this depth at the origin.
Seafloor sloping_bed(double depth_m, const Vector2d& slope, double half_extent_m = 60.0) {
  Seafloor bed = tests::level_bed(depth_m, half_extent_m);
  for (Eigen::Vector3f& p : bed.mesh.positions)
    p.z() += static_cast<float>(slope.dot(p.head<2>().cast<double>()));
  return bed;
}

/// A slope with relief of 0.2 m in cells of 0.25 m, 20 m wide.
Seafloor uneven_bed() {
  constexpr int cells = 80;
  Seafloor bed = tests::level_bed(20.0);
  bed.mesh.positions.clear();
  bed.mesh.faces.clear();
  for (int row = 0; row <= cells; ++row)
    for (int column = 0; column <= cells; ++column) {
      const float x = 0.25f * float(column) - 10.0f, y = 0.25f * float(row) - 10.0f;
      bed.mesh.positions.emplace_back(
          x, y, -20.0f + 0.1f * x - 0.05f * y + 0.2f * std::sin(x + 1.0f) * std::cos(1.5f * y));
    }
  for (std::uint32_t row = 0; row < cells; ++row)
    for (std::uint32_t column = 0; column < cells; ++column) {
      const std::uint32_t at = row * (cells + 1) + column, above = at + cells + 1;
      bed.mesh.faces.push_back({at, at + 1, above});
      bed.mesh.faces.push_back({at + 1, above + 1, above});
    }
  bed.bed_faces = bed.mesh.faces.size();
  return bed;
}

ObjectOptions stones(int count) {
  ObjectOptions stones;
  stones.shape = "boulder";
  stones.count = count;
  stones.scale_min = 0.5;
  stones.scale_max = 2.0;
  return stones;
}

PlacedObjects place(std::vector<ObjectOptions> tables, const Seafloor& bed,
                    std::uint64_t seed = 1) {
  return place_objects(tables, seed, BedGrid(bed));
}

/// The smallest distance between the vertices of two objects, seen from above.
double apart_m(const refine::TriangleMesh& a, const refine::TriangleMesh& b) {
  float least = 1e9f;
  for (const Eigen::Vector3f& p : a.positions)
    for (const Eigen::Vector3f& q : b.positions) least = std::min(least, (p - q).head<2>().norm());
  return least;
}

}  // namespace

TEST_CASE("Objects at random places keep their gap, their area and their margin") {
  const Seafloor bed = tests::level_bed(20.0, 60.0);
  ObjectOptions wall;  // in the middle
  wall.shape = "box";
  wall.size.length_m = 20.0;
  ObjectOptions table = stones(60);
  table.area = {{-10, -10}, {15, -10}, {15, 12}, {-10, 12}};
  table.gap_m = 0.25;
  table.margin_m = 1.0;
  const PlacedObjects placed = place({table, wall}, bed);
  REQUIRE(placed.objects.size() == 61);
  for (std::size_t i = 0; i < 61; ++i) {
    for (std::size_t j = 0; j < i; ++j)
      REQUIRE(apart_m(placed.objects[i].mesh, placed.objects[j].mesh) >= 0.25 - 1e-4);
    if (i == 60) break;
    const refine::Bounds box = refine::bounds(placed.objects[i].mesh);
    REQUIRE(box.lowest.x() >= -9.0f);
    REQUIRE(box.highest.x() <= 14.0f);
    REQUIRE(box.lowest.y() >= -9.0f);
    REQUIRE(box.highest.y() <= 11.0f);
    REQUIRE(box.lowest.z() == Approx(-20.0));
  }
}

TEST_CASE("The discs of long objects lie along them, whatever their heading") {
  const Seafloor bed = tests::level_bed(20.0, 60.0);
  ObjectOptions poles;
  poles.shape = "box";
  poles.size.length_m = 12.0;
  poles.size.width_m = 0.3;
  poles.count = 20;
  poles.area_radius_m = 20.0;
  poles.gap_m = 0.1;
  const PlacedObjects placed = place({poles}, bed);
  for (std::size_t i = 0; i < 20; ++i) {
    // The corners of one box, in the frame of the other box.
    for (std::size_t j = 0; j < 20; ++j) {
      if (i == j) continue;
      const ObjectRecord& own = placed.objects[j].record;
      const double c = std::cos(own.heading_rad), s = std::sin(own.heading_rad);
      for (const Eigen::Vector3f& p : placed.objects[i].mesh.positions) {
        const Vector2d from = (p.cast<double>() - own.middle_m).head<2>();
        REQUIRE((std::abs(c * from.x() - s * from.y()) > 0.15 ||
                 std::abs(s * from.x() + c * from.y()) > 6.0));
      }
    }
    REQUIRE(placed.objects[i].record.middle_m.head<2>().norm() < 20.0);
  }
}

TEST_CASE("An object's place, heading and size depend on the seed and not on later objects") {
  const Seafloor bed = tests::level_bed(20.0, 60.0);
  const auto positions = [&](const PlacedObjects& placed, std::size_t i) {
    return placed.objects.at(i).mesh.positions;
  };
  const PlacedObjects few = place({stones(5)}, bed), many = place({stones(9), stones(3)}, bed);
  for (std::size_t i = 0; i < 5; ++i) CHECK(positions(few, i) == positions(many, i));
  CHECK(positions(place({stones(5)}, bed, 2), 0) != positions(few, 0));
  double least = 10.0, most = 0.0;
  for (const PlacedObjects::One& one : place({stones(200)}, bed).objects) {
    least = std::min(least, one.record.scale);
    most = std::max(most, one.record.scale);
  }
  CHECK(least == Approx(0.5).margin(0.05));
  CHECK(most == Approx(2.0).margin(0.05));
}

TEST_CASE("Objects that find no room are refused, with the number of those that did") {
  const Seafloor bed = tests::level_bed(20.0, 60.0);
  ObjectOptions table = stones(500);
  table.area_radius_m = 6.0;
  table.gap_m = 1.0;
  CHECK_THROWS_WITH(place({table}, bed), Catch::Contains("objects.0 (boulder): only ") &&
                                             Catch::Contains(" of 500 objects found room"));
  table = stones(1);
  table.area = {{100, 100}, {120, 100}, {110, 120}};  // off the bed
  CHECK_THROWS_AS(place({table}, bed), SceneError);
}

TEST_CASE("An object that follows the slope is tilted with the plane of the bed below it") {
  const Vector2d slope(0.2, -0.1);
  const Seafloor bed = sloping_bed(20.0, slope);
  ObjectOptions slab;
  slab.shape = "box";
  slab.size.length_m = 3.0;
  slab.size.width_m = 2.0;
  slab.size.shape_height_m = 0.5;
  slab.east_m = 4.0;
  slab.heading_rad = 0.7;
  slab.follow_slope = true;
  const PlacedObjects placed = place({slab}, bed);
  std::size_t under = 0;  // the slab's lower side lies in the bed's plane
  for (const Eigen::Vector3f& p : placed.objects.front().mesh.positions)
    under += std::abs(p.z() - (-20.0 + slope.dot(p.head<2>().cast<double>()))) < 1e-4;
  CHECK(under == 4);  // its corners
  CHECK(placed.objects.front().record.buried == Approx(0.0).margin(1e-4));
  for (const double burial : {0.25, 1.0}) {
    slab.burial = burial;
    CHECK(place({slab}, bed).objects.front().record.buried == Approx(burial).margin(3e-3));
  }
}

TEST_CASE("Burial is a share of the height, and the record has it") {
  const Seafloor bed = tests::level_bed(20.0, 60.0);
  ObjectOptions crate;
  crate.shape = "box";
  crate.size.shape_height_m = 2.0;
  for (const double burial : {0.0, 0.25, 1.0}) {
    crate.burial = burial;
    const PlacedObjects placed = place({crate}, bed);
    CHECK(refine::bounds(placed.objects[0].mesh).highest.z() ==
          Approx(-18.0 - 2.001 * burial).margin(1e-5));
    CHECK(placed.objects[0].record.buried == Approx(burial).margin(1e-3));
  }
  ObjectOptions pipe;
  pipe.shape = "pipeline";
  pipe.path = {{-20, 0}, {20, 5}};
  pipe.burial = 0.5;
  const PlacedObjects placed = place({pipe}, bed);
  CHECK(placed.objects[0].record.buried == Approx(0.5).margin(1e-3));
  CHECK(refine::bounds(placed.objects[0].mesh).highest.z() == Approx(-20.0 + 0.3).margin(0.01));
}

TEST_CASE("The burial of a line changes along it, by its spread over its scale") {
  const Seafloor bed = tests::level_bed(20.0, 1000.0);
  ObjectOptions cable;
  cable.shape = "cable";
  cable.path = {{0, -480}, {0, 480}};
  cable.size.diameter_m = 0.2;
  cable.size.facet_m = 0.5;
  /// The burial of the line's upper edge by place along it.
  const auto burial_of = [&](std::uint64_t seed) {
    const PlacedObjects placed = place({cable}, bed, seed);
    std::map<int, double> highest_m;  // by half metres
    for (const Eigen::Vector3f& p : placed.objects[0].mesh.positions) {
      double& z_m =
          highest_m.try_emplace(static_cast<int>(std::lround(2.0 * p.y())), -1e9).first->second;
      z_m = std::max(z_m, double(p.z()));
    }
    std::vector<double> burial;
    for (const auto& [place, z_m] : highest_m) burial.push_back((-20.0 + 0.2 - z_m) / 0.201);
    return burial;
  };
  cable.burial = 0.9;
  cable.burial_spread = 0.2;
  cable.burial_scale_m = 6.0;
  const auto mean_of = [&](std::size_t apart) {
    double sum = 0.0, count = 0.0;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const std::vector<double> burial = burial_of(seed);
      for (std::size_t i = 0; i + apart < burial.size(); ++i, ++count)
        sum += (burial[i] - 0.9) * (burial[i + apart] - 0.9);
    }
    return sum / count;
  };
  const double variance = mean_of(0);
  CHECK(std::sqrt(variance) == Approx(0.2).epsilon(0.1));
  CHECK(mean_of(12) / variance == Approx(std::exp(-0.5)).epsilon(0.1));  // 6 m apart
  CHECK(burial_of(1) == burial_of(1));
  CHECK(burial_of(1) != burial_of(2));
  SECTION("but a line never floats") {
    cable.burial = 0.1;
    const std::vector<double> shallow = burial_of(1);
    CHECK(std::ranges::min(shallow) > -0.05);  // rings of a line that rises lean
    CHECK(std::ranges::max(shallow) > 0.4);
  }
}

TEST_CASE("A line that is scaled is as thick as a thicker line on a longer path") {
  const Seafloor bed = tests::level_bed(20.0, 60.0);
  for (const char* const shape : {"pipeline", "cable", "rope", "chain"}) {
    CAPTURE(shape);
    ObjectOptions scaled;
    scaled.shape = shape;
    scaled.path = {{-3, 0}, {3, 1}};
    scaled.scale = 2.0;
    ObjectOptions thicker;
    thicker.shape = shape;
    thicker.path = {{-6, 0}, {6, 2}};
    const Dimension& thickness = shape_named(shape).dimensions.front();
    thicker.size.*thickness.size = 2.0 * thickness.usual_m;
    CHECK(place({scaled}, bed).objects[0].mesh.positions ==
          place({thicker}, bed).objects[0].mesh.positions);
  }
}

TEST_CASE("On an uneven bed, a burial of 0 touches it and one of 1 is covered by it") {
  const Seafloor bed = uneven_bed();
  const BedGrid grid(bed);
  ObjectOptions crate;
  crate.shape = "box";
  crate.size.length_m = 4.0;
  crate.size.width_m = 3.0;
  crate.size.shape_height_m = 1.0;
  crate.heading_rad = 0.4;
  /// The least and the greatest height of the crate over the bed, at many places of all its faces.
  const auto over_bed_m = [&](double burial) {
    crate.burial = burial;
    const PlacedObjects placed = place({crate}, bed);
    double least = 1e9, greatest = -1e9;
    const refine::TriangleMesh& mesh = placed.objects.front().mesh;
    for (const refine::Face& face : mesh.faces)
      for (int i = 0; i <= 100; ++i)
        for (int j = 0; j <= 100 - i; ++j) {
          const Eigen::Vector3f p =
              (float(i) * mesh.positions[face[0]] + float(j) * mesh.positions[face[1]] +
               float(100 - i - j) * mesh.positions[face[2]]) /
              100.0f;
          const double above = double(p.z()) - grid.height_m(double(p.x()), double(p.y()));
          least = std::min(least, above);
          greatest = std::max(greatest, above);
        }
    return std::pair(least, greatest);
  };
  for (const double east_m : {0.0, -2.6}) {  // lowest under an edge of the crate; under its middle
    CAPTURE(east_m);
    crate.east_m = east_m;
    constexpr double between_m = 5e-3;  // edges of the crate and of the bed may cross a little
    const auto [touching_m, top_m] = over_bed_m(0.0);
    CHECK(touching_m == Approx(0.0).margin(between_m));
    CHECK(top_m > 1.2);  // over the lowest bed under it
    const auto [bottom_m, covered_m] = over_bed_m(1.0);
    CHECK(covered_m == Approx(-1e-3).margin(between_m));
    CHECK(over_bed_m(0.5).second == Approx(0.5 * (top_m + covered_m)).margin(2e-3));
  }
}

TEST_CASE(
    "A path is the same from CSV as from the scene, and a damaged one is refused with its line") {
  const tests::TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    std::ofstream(folder / "path.csv", std::ios::binary) << text;
    return read_path(folder / "path.csv");
  };
  CHECK(read("\xef\xbb\xbf"
             "east_m,north_m\r\n# the landing\r\n\r\n1, 2\r\n-3.5,4e1\r\n") ==
        std::vector<Vector2d>{{1, 2}, {-3.5, 40}});
  for (const auto& [text, message] :
       {std::pair{"", "path.csv:1: the file is empty"},
        {"x,y\n", "path.csv:1: no column east_m"},
        {"east_m,north_m\n1,2\n", "path.csv:2: a single point"},
        {"east_m,north_m\n1,2\n1,2\n1,2\n", "path.csv:3: the same point again"},
        {"east_m,north_m\n1,2,3\n", "path.csv:2: 3 values"},
        {"east_m,north_m\n1\n", "path.csv:2: 1 values"},
        {"east_m,north_m\n1,\n", "path.csv:2: north_m is ''"},
        {"east_m,north_m\nnan,2\n", "path.csv:2: east_m is 'nan'"},
        {"east_m,north_m\n1,1e300\n", "path.csv:2: a point at 1, 1e+300"}})
    CHECK_THROWS_WITH(read(text), Catch::Contains(message));
  CHECK_THROWS_AS(read_path(folder / "none.csv"), SceneError);
}

TEST_CASE("Ten thousand boulders are placed in seconds", "[slow]") {
  const Seafloor bed = tests::level_bed(20.0, 200.0);
  ObjectOptions table = stones(10000);
  table.scale_max = 1.0;
  const PlacedObjects placed = place({table}, bed);
  CHECK(placed.objects.size() == 10000);
}
