// The energy of objects and of their walls, and that rays or cells keep it.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "physics/body_in_water.h"
#include "support/beds.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/seafloor/objects/object_body.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/track_warnings.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/solid_target.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// The target strength of a body whose whole specular part comes from a rough surface.
double rough_strength_db(const refine::TriangleMesh& mesh, const scatter::Solid& solid,
                         double range_m, double heading_rad) {
  Sonar sonar = wide_sonar(20.0);
  sonar.planes = solid.lobe_width_rad < degree ? 1024 : 512;  // as close as the lobe needs
  return target_strength_db(echo_of({mesh, solid, 0.0, heading_rad}, sonar, range_m), sonar);
}

}  // namespace

TEST_CASE("a sphere has the target strength a^2 / 4, however narrow its lobe, from every side") {
  constexpr double radius_m = 0.5, range_m = 10.0;
  for (const double lobe_deg : {10.0, 5.0, 3.0, 1.0, 0.5}) {
    const scatter::Solid solid{
        .diffuse_db = -120.0, .specular = 0.5, .lobe_width_rad = lobe_deg * degree};
    ObjectOptions ball{.shape = "sphere", .material = "mirror"};
    Material mirror{.name = "mirror", .model = "solid", .like = "steel"};
    mirror.lobe_width_rad = solid.lobe_width_rad;
    const refine::TriangleMesh mesh = mesh_of(ball, 1, {&mirror, 1});
    // At a short range the nearest point is nearer than the middle, and the sphere is relatively
    // flatter there.
    const double expected_db = scatter::to_db(
        solid.specular * std::pow(radius_m / 2.0 * (range_m - radius_m) / range_m, 2.0));
    for (const double heading_deg : {0.0, 11.0, 37.0}) {
      CAPTURE(lobe_deg, heading_deg, mesh.faces.size());
      CHECK(rough_strength_db(mesh, solid, range_m, heading_deg * degree) ==
            Approx(expected_db).margin(0.5));
    }
    // Facets that are not refined for the lobe: 8 degrees.
    const refine::TriangleMesh usual = mesh_of(ball, 1);
    if (lobe_deg <= 1.0)
      CHECK(std::abs(rough_strength_db(usual, solid, range_m, 0.0) - expected_db) > 3.0);
  }
}

TEST_CASE("the upright sides of an object that the sonar sees are its walls, by its material") {
  ShapeSize size;
  size.length_m = 2.0;
  size.width_m = 1.0;
  size.shape_height_m = 0.8;
  const auto walls = [&](double turned_rad, const WallMirror& mirror) {
    Sonar sonar = wide_sonar(30.0);
    sonar.planes = 512;
    return echo_of({body("box", size), nothing, 0.0, turned_rad, 0.0, mirror}, sonar, 20.0).walls;
  };
  CHECK(walls(0.0, {}).empty());
  // From abeam one side faces the sonar, 0.5 m before the middle; turned by 30 degrees two do.
  for (const double turned_deg : {0.0, 30.0}) {
    const std::vector<WallFacet> seen = walls(turned_deg * degree, {.smooth = 0.8});
    CAPTURE(turned_deg);
    REQUIRE(seen.size() == (turned_deg == 0.0 ? 1 : 2));
    for (const WallFacet& wall : seen) {
      CHECK(wall.normal.dot(wall.middle) < 0.0);
      CHECK(wall.height_m == Approx(0.8).epsilon(1e-3));
      CHECK(wall.reflected == Approx(0.8).epsilon(1e-6));
      CHECK(wall.slope == Approx(0.0).margin(1e-6));
    }
    CHECK(std::ranges::count_if(seen, [&](const WallFacet& wall) {
            return std::abs(wall.length_m - 2.0) < 1e-3 &&
                   std::abs(wall.normal.x() + std::cos(turned_deg * degree)) < 1e-3;
          }) == 1);
  }
  // A rough material has a part that is smooth and a part that its slopes spread.
  const std::vector<WallFacet> rough = walls(0.0, {.smooth = 0.1, .rough = 0.4, .slope = 0.2});
  REQUIRE(rough.size() == 2);
  CHECK((rough[0].reflected == Approx(0.1) && rough[0].slope == Approx(0.0).margin(1e-6)));
  CHECK((rough[1].reflected == Approx(0.4) && rough[1].slope == Approx(0.2)));
  // A side that leans too far is none: only the half of a lying cylinder's facets whose normals are
  // within 30 degrees of the level.
  size.diameter_m = 0.8;
  for (const WallFacet& wall :
       echo_of({body("cylinder", size), nothing, 0.0, 0.0, 0.0, {.smooth = 1.0}}, wide_sonar(30.0),
               20.0)
           .walls)
    CHECK(std::abs(wall.normal.z()) < 0.5);
}

TEST_CASE(
    "in a ping a wall adds its corner if it faces the sonar, by its material, and none if not") {
  const auto corner_db = [](const char* material, double heading_deg,
                            std::optional<double> loss_db = {}) {
    Scene scene;
    scene.texture = false;
    scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 120.0;
    scene.seafloor.cell_m = 2.0;
    scene.seafloor.depth_m = 20.0;
    scene.seafloor.fractal.height_at_1m_m = 0.0;
    scene.speckle = false;
    scene.sonars[0].range_m = 40.0;
    scene.sonars[0].bins = 800;
    scene.sonars[0].receiver.noise = false;
    scene.arrivals.double_bounce = true;
    scene.arrivals.wall_loss_db = loss_db;
    ObjectOptions box{.shape = "box", .material = material};
    box.east_m = 20.0;
    box.size.length_m = 4.0;
    box.size.width_m = 1.0;
    box.size.shape_height_m = 1.5;
    box.heading_rad = heading_deg * degree;
    scene.objects = {box};
    Simulator simulator(scene);
    const EchoLine& line = simulator.ping({.position = {0.0, 0.0, -10.0}})[1];
    double added = 0.0;
    for (std::size_t i = 0; i < line.bins.intensity.size(); ++i)
      added += double(line.bins.intensity[i]) - double(line.bins.intensity_mean[i]);
    return scatter::to_db(std::max(added, 1e-9));
  };
  const double facing_db = corner_db("steel", 0.0);
  CHECK(corner_db("steel", 0.0, 6.0) - corner_db("steel", 0.0, 0.0) == Approx(-6.0).margin(0.05));
  CHECK(facing_db < corner_db("steel", 0.0, 0.0));
  // The bed close to its foot is in both beams, however it is turned.
  CHECK(corner_db("steel", 5.0) < facing_db - 3.0);
  CHECK(corner_db("steel", 10.0) < facing_db - 6.0);
  CHECK(corner_db("steel", 20.0) < facing_db - 12.0);
  CHECK(corner_db("steel", 60.0) < facing_db - 40.0);
  // Rust and growth spread what a wall reflects over 15 degrees.
  CHECK(corner_db("fouled steel", 0.0) < facing_db - 4.0);
  CHECK(corner_db("fouled steel", 5.0) > corner_db("fouled steel", 0.0) - 3.0);
}

TEST_CASE(
    "a closed mesh echoes as the shape of the same form, inside out too, past both its ends") {
  const TemporaryFolder folder;
  Scene scene;
  scene.texture = scene.speckle = false;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 120.0;
  scene.seafloor.cell_m = 2.0;
  scene.seafloor.depth_m = 20.0;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.sonars[0].range_m = 40.0;
  scene.sonars[0].bins = 800;
  const auto with = [&](ObjectOptions object) {
    object.east_m = 15.0;
    scene.objects = {object};
    return Simulator(scene);
  };
  for (const auto& [material, length_m, width_m] :
       {std::tuple("steel", 4.0, 1.0), {"fouled steel", 4.0, 1.0}, {"stone", 0.2, 0.3}}) {
    ObjectOptions shape{.shape = "box", .material = material};
    shape.size.length_m = length_m;
    shape.size.width_m = width_m;
    shape.size.shape_height_m = width_m;
    refine::TriangleMesh mesh = body("box", shape.size);
    refine::write_ply(folder / "box.ply", mesh);
    for (refine::Face& face : mesh.faces) std::swap(face[1], face[2]);
    refine::write_ply(folder / "turned.ply", mesh);
    Simulator of_shape = with(shape);
    for (const char* file : {"box.ply", "turned.ply"}) {
      Simulator of_mesh = with({.mesh = {file, folder / file}, .material = material});
      for (const double end : {-1.0, 0.0, 1.0})
        for (int i = -4; i <= 4; ++i) {
          const double north_m = end * 0.5 * length_m + 0.05 * i;
          CAPTURE(material, file, north_m);
          const Pose pose{.position = {0.0, north_m, -12.0}};
          const EchoLine& expected = of_shape.ping_numbered(pose, 0)[1];
          const EchoLine& line = of_mesh.ping_numbered(pose, 0)[1];
          double worst_db = 0.0;
          for (std::size_t bin = 0; bin < line.bins.intensity_mean.size(); ++bin) {
            const auto level_db = [&](const EchoLine& of) {
              return scatter::to_db(std::max(double(of.bins.intensity_mean[bin]), 1.0));
            };
            worst_db = std::max(worst_db, std::abs(level_db(line) - level_db(expected)));
          }
          CHECK(worst_db < 0.05);
        }
    }
  }
}

TEST_CASE("a small object's energy does not depend on where the planes lie, and never vanishes") {
  for (const char* material : {"steel", "stone"})
    for (const double diameter_m : {0.3, 0.05}) {
      ShapeSize size;
      size.diameter_m = diameter_m;
      const refine::TriangleMesh mesh = body("sphere", size);
      const auto level_db = [&](int planes, double north_m) {
        Sonar sonar = plain_sonar();
        sonar.planes = planes;
        sonar.sector_low_rad = -0.08;
        sonar.sector_high_rad = 0.08;
        const scatter::Solid solid = scatter::solid_named(material);
        const EchoLine line =
            echo_of({mesh, solid.rough(), solid.smooth_specular(), 0.0, north_m}, sonar, 60.0);
        return target_strength_db(line, sonar);
      };
      CAPTURE(material, diameter_m);
      const double expected_db = level_db(8, 0.0);
      for (const int planes : {2, 4, 6, 12, 16, 24})
        if (planes < 16 || diameter_m < 0.1)
          CHECK(level_db(planes, 0.0) == Approx(expected_db).margin(planes > 8 ? 0.3 : 0.05));
      // Over the distance of two planes, 11 cm, against the beam's own pattern.
      double sum = 0.0, squares = 0.0;
      constexpr int places = 24;
      for (int i = 0; i < places; ++i) {
        const double north_m = 0.11 * (i - 0.5 * places) / places;
        const double sine = north_m / 60.0 * 0.5 / (1500.0 / 400e3) * std::numbers::pi;
        const double sinc = std::abs(sine) < 1e-6 ? 1.0 : std::sin(sine) / sine;
        const double off_db = level_db(8, north_m) - 40.0 * std::log10(sinc) - expected_db;
        sum += off_db;
        squares += off_db * off_db;
      }
      CHECK(std::sqrt(squares / places) < 0.1);
      CHECK(std::abs(sum / places) < 0.1);
    }
}

// There the rays are even in angle, and farther apart than the planes.
TEST_CASE(
    "a small object level with the sonar has its energy however many planes and rays there are") {
  ShapeSize size;
  size.diameter_m = 0.2;
  const refine::TriangleMesh mesh = body("sphere", size);
  const scatter::Solid solid = scatter::solid_named("stone");
  for (const double range_m : {30.0, 60.0})
    for (const double lift_rad : {0.0, 0.0011, 0.0021, 0.0035}) {
      const auto level_db = [&](int planes, int elevations, bool narrow) {
        Sonar sonar = plain_sonar();
        sonar.planes = planes;
        sonar.elevations = elevations;
        if (narrow) sonar.sector_low_rad = -0.08, sonar.sector_high_rad = 0.08;
        sonar.sector_low_rad += lift_rad;  // moves the rays, not the ball
        return target_strength_db(echo_of({mesh, solid}, sonar, range_m), sonar);
      };
      const double expected_db = level_db(64, 8192, true);
      CAPTURE(range_m, lift_rad);
      for (const int planes : {8, 16, 32, 48})
        for (const int elevations : {512, 1024, 2048}) {
          CAPTURE(planes, elevations);
          CHECK(level_db(planes, elevations, false) == Approx(expected_db).margin(0.3));
        }
    }
}

// Many planes meet them, of a fan of 1024; a usual one's pass beside them.
TEST_CASE(
    "an object that is long across the track and thin along it has its energy in every ping") {
  Sonar sonar = plain_sonar();
  sonar.sector_low_rad = -0.08;
  sonar.sector_high_rad = 0.08;
  const scatter::Solid stone = scatter::solid_named("stone");
  const auto level_db = [&](const refine::TriangleMesh& mesh, int planes, double north_m,
                            double heading_rad) {
    sonar.planes = planes;
    return target_strength_db(echo_of({mesh, stone, 0.0, heading_rad, north_m}, sonar, 60.0),
                              sonar);
  };
  ShapeSize thin;
  thin.length_m = 0.06;
  thin.width_m = 3.0;
  thin.shape_height_m = 0.15;
  const refine::TriangleMesh bar = body("box", thin);
  for (const double north_m : {-0.055, -0.02, 0.0, 0.03}) {
    CAPTURE(north_m);
    const double expected_db = level_db(bar, 1024, north_m, 0.0);
    for (const int planes : {4, 8, 32})
      CHECK(level_db(bar, planes, north_m, 0.0) == Approx(expected_db).margin(0.3));
  }
  // A ladder seen end on: the nearer rungs hide the farther ones, also rungs that are less far
  // apart than a small object is long.
  const refine::TriangleMesh ladder = body("ladder", {});
  CHECK(level_db(ladder, 8, 0.0, 90.0 * degree) < level_db(ladder, 1024, 0.0, 90.0 * degree) + 2.5);
}

TEST_CASE("a lone steel sphere does not fade: over 60 seeds its echo is steady, a stone's is not") {
  const auto spread = [](const char* material) {
    Scene scene;
    scene.texture = false;
    scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 120.0;
    scene.seafloor.cell_m = 2.0;
    scene.seafloor.depth_m = 60.0;
    scene.seafloor.fractal.height_at_1m_m = 0.0;
    scene.sonars[0].range_m = 40.0;
    scene.sonars[0].bins = 1600;
    scene.sonars[0].receiver.noise = false;
    ObjectOptions ball{.shape = "sphere", .material = material};
    ball.east_m = 30.0;
    ball.height_m = 40.0;
    ball.size.diameter_m = 0.3;
    scene.objects = {ball};
    std::vector<double> energies;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
      scene.seed = seed;
      Simulator simulator(scene);
      const EchoLine& line = simulator.ping({.position = {0.0, 0.0, -19.5}})[1];
      const auto brightest = std::ranges::max_element(line.bins.intensity_mean);
      const auto bin = static_cast<std::size_t>(brightest - line.bins.intensity_mean.begin());
      CHECK(line.bins.instance[bin] == 1);
      energies.push_back(double(line.bins.intensity[bin] / *brightest));
    }
    const double mean = std::accumulate(energies.begin(), energies.end(), 0.0) / 60.0;
    double squares = 0.0;
    for (const double energy : energies) squares += std::pow(energy / mean - 1.0, 2.0);
    CHECK(mean == Approx(1.0).margin(0.3));
    return std::sqrt(squares / 60.0);
  };
  CHECK(spread("steel") < 0.15);
  CHECK(spread("stone") > 0.6);
}

TEST_CASE(
    "one warning names all features that are shorter than the distance of planes, with the remedy") {
  Seafloor seafloor = level_bed(20.0, 100.0);
  seafloor.classes = {"none", "seabed", "mine", "boulder"};
  Sonar sonar;
  sonar.planes = 8;
  std::vector<Pose> line;
  for (int i = 0; i < 5000; ++i) line.push_back({.position = {0.0, 0.01 * i - 25.0, -10.0}});
  const auto told = [&] { return coarse_planes_warning({&sonar, 1}, 1500.0, seafloor, line); };
  CHECK_FALSE(told());
  const auto add = [&](double east_m, const Eigen::Vector3d& size_m) {
    seafloor.features.push_back(
        {.layer = "boulders.1", .middle_m = {east_m, 0.0, -20.0}, .size_m = size_m});
    seafloor.features.back().label = {
        .class_id = 3, .instance = static_cast<std::uint16_t>(seafloor.features.size())};
  };
  // lambda / 4 L per metre of range: 9.4 cm at 50 m, near the sector's middle.
  const double depression_rad = std::asin(10.0 / std::hypot(10.0, 49.0));
  const double off_rad = depression_rad - 0.5 * (sonar.sector_low_rad + sonar.sector_end_rad());
  const double apart_m =
      1500.0 / 400e3 / 4.0 / sonar.array_length_m * std::hypot(10.0, 49.0) * std::cos(off_rad);
  add(49.0, {0.01, 1.02 * apart_m, 0.1});  // narrow across the track, and long enough along it
  CHECK_FALSE(told());
  add(90.0, {0.01, 0.01, 0.01});  // out of range
  CHECK_FALSE(told());
  add(49.0, {1.0, 0.98 * apart_m, 0.1});
  REQUIRE(told());
  INFO(*told());
  CHECK(told()->starts_with("boulders.1 (instance 3, boulder) is 0.0"));
  CHECK(told()->find("range of 50 m") != std::string::npos);
  CHECK(told()->ends_with("set sonar.sidescan.planes = 10"));
  // Thousands of features still give one warning.
  for (int i = 0; i < 3000; ++i)
    seafloor.features.push_back({.layer = "boulders.0",
                                 .middle_m = {40.0, 0.01 * i, -20.0},
                                 .size_m = {0.02, 0.02, 0.02},
                                 .label = {.class_id = 3, .instance = 9}});
  CHECK(told()->starts_with("boulders.0 (instance 9, boulder) is 0.02 m long"));
  CHECK(told()->find("(3000 more are too short as well)") != std::string::npos);
  CHECK(told()->size() < 300);
  sonar.planes = 64;
  sonar.range_m = 45.0;
  CHECK_FALSE(told());
}
