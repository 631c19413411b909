// The echo of a solid against its closed form.

#include <cmath>
#include <numbers>
#include <numeric>

#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/sonar/echo/plane_spacing.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/solid_target.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr double degree = std::numbers::pi / 180.0;

/// The target strength of a body alone in the water, at a range from its middle.
double target_strength_db(const refine::TriangleMesh& mesh, const scatter::Solid& solid,
                          double range_m, double heading_rad) {
  Seafloor alone;
  alone.mesh = mesh;
  const float c = static_cast<float>(std::cos(heading_rad)),
              s = static_cast<float>(std::sin(heading_rad));
  for (Eigen::Vector3f& p : alone.mesh.positions)
    p = {c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z() - 20.0f};
  alone.bed_faces = 0;
  alone.labels = {{1, 1, 1}};
  Sonar sonar = plain_sonar();
  sonar.array_length_m =
      0.03;  // the beam is wider than the body, and planes are as close as the lobe needs
  sonar.planes = solid.lobe_width_rad < degree ? 1024 : 512;
  sonar.range_m = 20.0;
  sonar.bins = 400;
  sonar.source_level_db = 0.0;
  sonar.sector_low_rad = -0.08;
  sonar.sector_high_rad = 0.08;
  const std::vector<scatter::BackscatterTable> tables(
      2, scatter::BackscatterTable(scatter::SolidTarget(solid)));
  const Medium medium;
  PingTracer pinger(sonar, medium, alone, tables);
  const Pose pose{.position = {-range_m, 0.0, -20.0}};
  pinger.aim(pose, 10.0);
  EchoLine line;
  line.side = Side::starboard;
  line.bins.assign(static_cast<std::size_t>(sonar.bins));
  const auto tracer = make_intersector("embree", alone.mesh);
  pinger.trace(*tracer, alone.mesh, 0, line.side);
  pinger.echo(alone.mesh, line.side, line);
  double energy = 0.0;
  for (std::size_t i = 0; i < line.bins.range_m.size(); ++i)
    energy += line.bins.intensity_mean[i] * std::pow(line.bins.range_m[i], 4);
  return scatter::to_db(energy * sonar.bin_m() / sonar.pulse.cell_m(medium.sound_speed_mps));
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
      CHECK(target_strength_db(mesh, solid, range_m, heading_deg * degree) ==
            Approx(expected_db).margin(0.5));
    }
    // Facets that are not refined for the lobe: 8 degrees.
    const refine::TriangleMesh usual = mesh_of(ball, 1);
    if (lobe_deg <= 1.0)
      CHECK(std::abs(target_strength_db(usual, solid, range_m, 0.0) - expected_db) > 3.0);
  }
}

TEST_CASE(
    "one warning names all things that are shorter than the distance of planes, with the cure") {
  Seafloor seafloor = level_bed(20.0, 100.0);
  seafloor.classes = {"none", "seabed", "mine", "boulder"};
  Sonar sonar;
  sonar.planes = 8;
  std::vector<Pose> line;
  for (int i = 0; i < 5000; ++i) line.push_back({.position = {0.0, 0.01 * i - 25.0, -10.0}});
  const auto told = [&] { return coarse_planes_warning({&sonar, 1}, 1500.0, seafloor, line); };
  CHECK_FALSE(told());
  const auto add = [&](double east_m, Eigen::Vector3d size_m) {
    seafloor.objects.push_back({.middle_m = {east_m, 0.0, -20.0}, .size_m = size_m});
    seafloor.objects.back().label = {
        .class_id = 2, .instance = static_cast<std::uint16_t>(seafloor.objects.size())};
  };
  // lambda / 4 L per metre of range: 9.4 cm at 50 m, near the sector's middle.
  const double depression_rad = std::asin(10.0 / std::hypot(10.0, 49.0));
  const double off_rad = depression_rad - 0.5 * (sonar.sector_low_rad + sonar.sector_high_rad);
  const double apart_m =
      1500.0 / 400e3 / 4.0 / sonar.array_length_m * std::hypot(10.0, 49.0) * std::cos(off_rad);
  add(49.0, {0.01, 1.02 * apart_m, 0.1});  // narrow across the track, and long enough along it
  CHECK_FALSE(told());
  add(90.0, {0.01, 0.01, 0.01});  // out of range
  CHECK_FALSE(told());
  add(49.0, {1.0, 0.98 * apart_m, 0.1});
  REQUIRE(told());
  INFO(*told());
  CHECK(told()->starts_with("objects.0 (instance 3, mine) is 0.0"));
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
