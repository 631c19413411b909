// A scan of a grid gives the runs of fan_scan over the whole mesh, to the bit.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>

#include <Eigen/Geometry>

#include "support/catch.h"
#include "support/fans.h"
#include "support/heights.h"
#include "support/meshes.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/trace/check/adversarial_rays.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/engine/trace/grid_scan/grid_scan.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/refine/ball_tree.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;
using ensonify::tests::fan_to_side;
using ensonify::tests::SideLook;

namespace {

constexpr double bed_z_m = -20.0;

/// A slope with ripples and noise.
tests::Heights rippled_slope(int columns, int rows, double ripple_m, double noise_m,
                             tests::Random& random, double cell_m = 0.25) {
  tests::Heights heights{columns, rows, cell_m, {}};
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const double x_m = heights.cell_m * column, y_m = heights.cell_m * row;
      heights.z_m.push_back(bed_z_m + 0.02 * x_m + ripple_m * std::sin(3.0 * x_m + y_m) +
                            noise_m * tests::uniform(random, -1.0, 1.0));
    }
  return heights;
}

std::shared_ptr<const FanGrid> angles(double low_deg, double high_deg, double truncation_rad,
                                      int elevations = 600) {
  return std::make_shared<const FanGrid>(FanLayout{.sector_low_rad = low_deg * degree,
                                                   .sector_high_rad = high_deg * degree,
                                                   .truncation_rad = truncation_rad,
                                                   .main_lobe_rad = 0.04,
                                                   .planes = 6,
                                                   .elevations = elevations});
}

SideLook random_look(tests::Random& random) {
  return {.origin = {tests::uniform(random, -10.0, 10.0), tests::uniform(random, -10.0, 10.0),
                     bed_z_m + tests::uniform(random, 3.0, 15.0)},
          .roll_rad = tests::uniform(random, -0.1, 0.1),
          .pitch_rad = tests::uniform(random, -0.1, 0.1),
          .yaw_rad = tests::uniform(random, 0.0, 6.3),
          .port = tests::uniform(random) < 0.5};
}

struct RunCount {
  std::size_t runs = 0, differences = 0;
};

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

/// Counts the runs of `found` that differ from those expected, or whose index does not lead to
/// their face among the triangles.
void compare_runs(const FanRuns& expected, const FanRuns& found, const refine::Triangles& triangles,
                  RunCount& count) {
  REQUIRE(found.first == expected.first);
  count.runs += expected.size();
  for (std::size_t i = 0; i < expected.size(); ++i)
    count.differences += found.begin[i] != expected.begin[i] || found.end[i] != expected.end[i] ||
                         found.face[i] != expected.face[i] ||
                         !same_bits(found.level[i], expected.level[i]) ||
                         !same_bits(found.pole[i], expected.pole[i]) ||
                         !same_bits(found.distance[i], expected.distance[i]) ||
                         triangles.number(found.index[i]) != expected.face[i];
}

/// A face source over a bed and objects, and the same faces as one mesh.
struct Scanned {
  std::shared_ptr<const refine::HeightGrid> grid;
  refine::TriangleMesh objects, mesh;
  std::unique_ptr<Intersector> whole;
  std::unique_ptr<FaceSource> source;
  Scanned(const tests::Heights& heights, refine::TriangleMesh of_objects)
      : grid(std::make_shared<const refine::HeightGrid>(heights.grid())),
        objects(std::move(of_objects)),
        mesh(grid->mesh()) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Eigen::Vector3f& p : objects.positions) mesh.positions.push_back(p);
    for (const refine::Face& face : objects.faces)
      mesh.faces.push_back({face[0] + first, face[1] + first, face[2] + first});
    whole = make_intersector("fan_scan", mesh);
    source = make_footprint_faces(
        {.grid = grid,
         .objects = std::make_shared<const refine::BallTree>(refine::Triangles(objects)),
         .intersector = "fan_scan"});
  }
  /// Returns whether the grid was scanned.
  bool compare(std::span<const RayFan> fans, RunCount& count) {
    TracedFaces faces = source->prepare_runs(fans);
    for (std::size_t i = 0; i < fans.size(); ++i) {
      FanRuns expected, found;
      REQUIRE(whole->list_runs(fans[i], expected));
      REQUIRE(list_runs(faces, fans[i], i, found));
      compare_runs(expected, found, triangles_of(faces), count);
    }
    return std::holds_alternative<FoundRuns>(faces);
  }
};

}  // namespace

TEST_CASE("A scan of a grid gives the runs of fan_scan, to the bit") {
  tests::Random random(7);
  RunCount count;
  int scanned = 0, refused = 0;
  for (int bed_number = 0; bed_number < 12; ++bed_number) {
    const refine::HeightGrid grid = rippled_slope(200 + 50 * bed_number, 300, bed_number % 3 * 0.1,
                                                  bed_number % 4 * 0.02, random)
                                        .grid();
    const refine::TriangleMesh mesh = grid.mesh();
    const auto whole = make_intersector("fan_scan", mesh);
    GridScan scan(grid);
    for (int number = 0; number < 20; ++number) {
      CAPTURE(bed_number, number);
      SideLook look = random_look(random);
      if (number % 4 == 0) look.pitch_rad = 0.0;
      if (number % 7 == 0) look.yaw_rad = 0.0;  // along the grid's lines
      if (number % 6 == 0) look.range_m = 20.0;
      const RayFan fan = fan_to_side(
          look,
          angles(number % 2 ? 5.0 : -10.0, 95.0 - number % 3 * 15.0, number % 5 == 0 ? 0.4 : 0.05));
      if (!scan.take({&fan, 1})) {
        ++refused;
        continue;
      }
      ++scanned;
      FanRuns expected;
      REQUIRE(whole->list_runs(fan, expected));
      compare_runs(expected, scan.runs(0), scan.triangles(), count);
    }
  }
  CHECK(count.runs > 300'000);
  CHECK(count.differences == 0);
  CHECK(scanned > 200);
  CHECK(refused < 20);
}

TEST_CASE("A scan of a grid gives fan_scan's runs, or refuses, at any roll") {
  struct Case {
    double cell_m, ripple_m, noise_m;
    int columns, rows, looks;
  };
  tests::Random random(13);
  RunCount count;
  int scanned = 0;
  // In coarse cells walks begin behind the sonar.
  for (const Case& of : {Case{0.25, 0.1, 0.02, 400, 300, 200}, Case{1.0, 0.0, 0.1, 40, 40, 400},
                         Case{4.0, 0.0, 0.4, 40, 40, 400}, Case{20.0, 0.0, 2.0, 40, 40, 400}}) {
    const refine::HeightGrid grid =
        rippled_slope(of.columns, of.rows, of.ripple_m, of.noise_m, random, of.cell_m).grid();
    const refine::TriangleMesh mesh = grid.mesh();
    const auto whole = make_intersector("fan_scan", mesh);
    GridScan scan(grid);
    for (int number = 0; number < of.looks; ++number) {
      SideLook look = random_look(random);
      look.origin.x() *= std::max(of.cell_m, 1.0);
      look.roll_rad = tests::uniform(random, -180.0, 180.0) * degree;
      CAPTURE(of.cell_m, number, look.roll_rad);
      const RayFan fan = fan_to_side(look, angles(-10.0, 95.0, 0.05));
      if (!scan.take({&fan, 1})) continue;
      ++scanned;
      FanRuns expected;
      REQUIRE(whole->list_runs(fan, expected));
      compare_runs(expected, scan.runs(0), scan.triangles(), count);
    }
  }
  CHECK(scanned > 300);
  CHECK(count.runs > 60'000);
  CHECK(count.differences == 0);
}

TEST_CASE("Rays aimed at the grid's points and edges get fan_scan's runs, or no scan") {
  tests::Random random(11);
  RunCount count;
  int scanned = 0;
  for (const double noise_m : {0.0, 0.02, 0.1}) {
    const refine::HeightGrid grid = rippled_slope(90, 90, 0.1, noise_m, random).grid();
    const refine::TriangleMesh mesh = grid.mesh();
    const auto whole = make_intersector("fan_scan", mesh);
    const auto reference = make_intersector("pluecker", mesh);
    const AdversarialRays rays(mesh, 1);
    GridScan scan(grid);
    for (std::uint64_t number = 0; number < 500; ++number) {
      CAPTURE(noise_m, number);
      const RayFan fan = rays.aim(number, *reference);
      if (!scan.take({&fan, 1})) continue;
      ++scanned;
      FanRuns expected;
      REQUIRE(whole->list_runs(fan, expected));
      compare_runs(expected, scan.runs(0), scan.triangles(), count);
    }
  }
  CHECK(count.runs > 30'000);
  CHECK(count.differences == 0);
  CHECK(scanned > 250);
}

TEST_CASE("A fan whose last ray passes a crest gets fan_scan's runs, or no scan") {
  tests::Random random(12);
  tests::Heights ridge{81, 21, 0.25, {}};
  for (int i = 0; i < ridge.columns * ridge.rows; ++i)
    ridge.z_m.push_back(bed_z_m - 0.5 * std::abs(i % ridge.columns - 60) * ridge.cell_m);
  const refine::HeightGrid grid = ridge.grid();
  const double crest_x_m = double{grid.x(60)};
  const refine::TriangleMesh mesh = grid.mesh();
  const auto whole = make_intersector("fan_scan", mesh);
  GridScan scan(grid);
  RunCount count;
  int scanned = 0;
  for (int number = 0; number < 3000; ++number) {
    CAPTURE(number);
    const Vector3d origin(tests::uniform(random, -9.0, 0.0), tests::uniform(random, -1.0, 1.0),
                          bed_z_m + tests::uniform(random, 2.0, 8.0));
    FanGrid rays(FanLayout{.sector_high_rad = 1.0, .truncation_rad = 1.0, .main_lobe_rad = 1.0});
    rays.planes = {{0.0, 1.0, 1.0}};
    rays.elevation_rad.clear(), rays.sin_elevation.clear(), rays.cos_elevation.clear();
    // From steeply down, in the plane of x and z, to the crest.
    const double last_rad = std::atan2(bed_z_m - origin.z(), crest_x_m - origin.x());
    for (int ray = 30; ray >= 0; --ray) {
      rays.elevation_rad.push_back(last_rad - (last_rad + 1.5) / 30 * ray);
      rays.sin_elevation.push_back(std::sin(rays.elevation_rad.back()));
      rays.cos_elevation.push_back(std::cos(rays.elevation_rad.back()));
    }
    const RayFan fan{.grid = std::make_shared<const FanGrid>(std::move(rays)),
                     .origin = origin,
                     .array_axis = Vector3d::UnitY(),
                     .middle = Vector3d::UnitX(),
                     .pole = Vector3d::UnitZ(),
                     .range_m = 50.0};
    if (!scan.take({&fan, 1})) continue;
    ++scanned;
    FanRuns expected;
    REQUIRE(whole->list_runs(fan, expected));
    compare_runs(expected, scan.runs(0), scan.triangles(), count);
  }
  CHECK(count.runs > 30'000);
  CHECK(count.differences == 0);
  CHECK(scanned > 1000);
}

TEST_CASE("Objects on a scanned grid hide it, and it hides them, as in one mesh") {
  tests::Random random(8);
  const tests::Heights heights = rippled_slope(300, 300, 0.1, 0.02, random);
  const refine::TriangleMesh ground = heights.grid().mesh();
  refine::TriangleMesh objects;
  const auto add = [&](const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const auto first = static_cast<std::uint32_t>(objects.positions.size());
    for (const Vector3d& p : {a, b, c}) objects.positions.emplace_back(p.cast<float>());
    objects.faces.push_back({first, first + 1, first + 2});
  };
  for (int i = 0; i < 300; ++i) {
    const auto number = static_cast<std::size_t>(
        tests::uniform(random, 0.0, static_cast<double>(ground.positions.size())));
    const Vector3d on_bed = ground.positions[number].cast<double>();
    if (i % 3 == 0)  // a plate through the bed
      add(on_bed + 0.6 * tests::direction(random), on_bed + 0.6 * tests::direction(random),
          on_bed + 0.6 * tests::direction(random));
    if (i % 3 == 1)  // a wire along it
      add(on_bed, on_bed + Vector3d(2.0, 0.5, 0.1), on_bed + Vector3d(2.0, 0.501, 0.1));
    if (i % 3 == 2) {  // a face of the bed itself
      const refine::Face& face = ground.faces[number];
      add(ground.positions[face[0]].cast<double>(), ground.positions[face[1]].cast<double>(),
          ground.positions[face[2]].cast<double>());
    }
  }
  Scanned over(heights, objects);
  RunCount count;
  int scanned = 0;
  for (int number = 0; number < 40; ++number) {
    CAPTURE(number);
    SideLook look = random_look(random);
    const auto of_grid = angles(5.0, 90.0, 0.05);
    look.port = false;
    const RayFan starboard = fan_to_side(look, of_grid);
    look.port = true;
    const std::array<RayFan, 2> fans{fan_to_side(look, of_grid), starboard};
    scanned += over.compare(fans, count);
  }
  CHECK(count.runs > 100'000);
  CHECK(count.differences == 0);
  CHECK(scanned > 35);
}

TEST_CASE("Fans with equal rays each get their runs from a scanned grid") {
  tests::Random random(9);
  Scanned over(rippled_slope(200, 200, 0.1, 0.02, random), {});
  const RayFan fan = fan_to_side({.origin = {0.0, 0.0, bed_z_m + 8.0}}, angles(5.0, 85.0, 0.05));
  const std::array<RayFan, 2> fans{fan, fan};
  RunCount count;
  CHECK(over.compare(fans, count));
  CHECK(count.runs > 1000);
  CHECK(count.differences == 0);
}

TEST_CASE("Fans that differ in rays, range and look get the same runs together as alone") {
  tests::Random random(10);
  const refine::HeightGrid grid = rippled_slope(300, 300, 0.1, 0.02, random).grid();
  GridScan together(grid), alone(grid);
  RunCount count;
  for (int number = 0; number < 10; ++number) {
    const SideLook look = random_look(random);
    SideLook other = random_look(random);
    other.range_m = 12.0;
    const std::array<RayFan, 3> fans{fan_to_side(look, angles(5.0, 85.0, 0.05)),
                                     fan_to_side(other, angles(20.0, 95.0, 0.4, 450)),
                                     fan_to_side(look, angles(5.0, 85.0, 0.05, 700))};
    if (!together.take(fans)) continue;
    for (std::size_t i = 0; i < fans.size(); ++i) {
      REQUIRE(alone.take({&fans[i], 1}));
      compare_runs(alone.runs(0), together.runs(i), together.triangles(), count);
    }
  }
  CHECK(count.runs > 10'000);
  CHECK(count.differences == 0);
}

TEST_CASE("A grid is scanned whose cliffs run across the planes, however steep they are") {
  tests::Random random(11);
  tests::Heights heights = rippled_slope(120, 120, 0.1, 0.02, random);
  for (int row = 0; row < 120; ++row)
    for (const int column : {75, 76, 90, 105})
      heights.z_m[static_cast<std::size_t>(row * 120 + column)] += 5.0;
  Scanned over(heights, {});
  const RayFan fan =
      fan_to_side({.origin = {0.0, 0.0, bed_z_m + 6.0}, .pitch_rad = 0.2}, angles(5.0, 85.0, 0.05));
  RunCount count;
  CHECK(over.compare({&fan, 1}, count));
  CHECK(count.runs > 100);
  CHECK(count.differences == 0);
}

TEST_CASE("A grid is scanned under objects with as many faces as it has") {
  tests::Random random(10);
  const tests::Heights heights = rippled_slope(120, 120, 0.1, 0.02, random);
  refine::TriangleMesh objects;
  while (objects.faces.size() < 2 * 119 * 119) {
    const Vector3d at(tests::uniform(random, -10.0, 10.0), tests::uniform(random, -10.0, 10.0),
                      bed_z_m + 0.2);
    const auto first = static_cast<std::uint32_t>(objects.positions.size());
    for (int k = 0; k < 3; ++k)
      objects.positions.emplace_back((at + 0.3 * tests::direction(random)).cast<float>());
    objects.faces.push_back({first, first + 1, first + 2});
  }
  Scanned over(heights, objects);
  const RayFan fan = fan_to_side({.origin = {0.0, 0.0, bed_z_m + 6.0}}, angles(5.0, 85.0, 0.05));
  RunCount count;
  CHECK(over.compare({&fan, 1}, count));
  CHECK(count.runs > 100);
  CHECK(count.differences == 0);
}

TEST_CASE("Where a grid cannot be scanned, the runs are those of its faces") {
  tests::Random random(10);
  tests::Heights heights = rippled_slope(120, 120, 0.1, 0.02, random);
  SideLook look{.origin = {0.0, 0.0, bed_z_m + 6.0}};
  std::shared_ptr<const FanGrid> grid = angles(5.0, 85.0, 0.05);
  SECTION("it has a hole") {
    heights.z_m[60 * 120 + 90] = std::numeric_limits<double>::quiet_NaN();
  }
  SECTION("the sonar is beyond its border") { look.origin.x() = -18.0; }
  SECTION("the sonar is below a crest") { heights.z_m[60 * 120 + 60] = bed_z_m + 7.0; }
  SECTION("a cliff that faces the planes is steeper than they are") {
    for (int column = 0; column < 120; ++column)
      heights.z_m[static_cast<std::size_t>(90 * 120 + column)] += 5.0;
    look.pitch_rad = 0.2;
  }
  Scanned over(heights, {});
  const RayFan fan = fan_to_side(look, grid);
  RunCount count;
  CHECK_FALSE(over.compare({&fan, 1}, count));
  CHECK(count.runs > 100);
  CHECK(count.differences == 0);
}
