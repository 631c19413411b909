// What lies just behind a surface that lets no sound through has no echo.

#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "physics/body_in_water.h"
#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr double east_m = 9.0;

Scene scene_with_bed(bool rough) {
  Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 60.0;
  scene.seafloor.cell_m = 0.5;
  scene.seafloor.depth_m = 14.0;
  scene.seafloor.fractal.height_at_1m_m = rough ? 0.02 : 0.0;
  scene.speckle = scene.texture = false;
  Sonar& sonar = scene.sonars.front();
  sonar = plain_sonar();
  sonar.range_m = 25.0;
  sonar.bins = 320;
  sonar.pulse.bandwidth_hz = 10e3;
  return scene;
}

/// The bins of the starboard side in pings that pass the place of the objects.
std::vector<BinLayers> pings(Simulator& simulator) {
  std::vector<BinLayers> all;
  for (int i = -12; i <= 12; ++i) {
    const Pose pose{.position = {0.0, 0.1 * i, -8.0}};
    all.push_back(simulator.ping_numbered(pose, static_cast<std::uint64_t>(i + 12))[1].bins);
  }
  return all;
}

double energy_of(const std::vector<BinLayers>& all) {
  double sum = 0.0;
  for (const BinLayers& bins : all)
    sum += std::accumulate(bins.intensity_mean.begin(), bins.intensity_mean.end(), 0.0);
  return sum;
}

void check_same(const std::vector<BinLayers>& got, const std::vector<BinLayers>& expected) {
  REQUIRE(got.size() == expected.size());
  for (std::size_t i = 0; i < got.size(); ++i) {
    CAPTURE(i);
    CHECK(got[i].intensity_mean == expected[i].intensity_mean);
    CHECK(got[i].instance == expected[i].instance);
  }
}

}  // namespace

TEST_CASE("an object that the bed covers has neither an echo nor a label, however thin the cover") {
  for (const bool rough : {false, true})
    for (const char* surface : {"static", "footprint"})
      for (const char* intersector : {"embree", "fan_scan"}) {
        Scene scene = scene_with_bed(rough);
        scene.run.surface = surface;
        scene.run.intersector = intersector;
        Simulator bare(scene);
        const std::vector<BinLayers> expected = pings(bare);
        for (const char* shape : {"tyre", "cylinder", "barrel", "sphere", "box", "wedge"})
          for (const double heading_deg : {0.0, 8.0}) {
            ObjectOptions object{.shape = shape, .material = "steel"};
            object.east_m = east_m;
            object.heading_rad = heading_deg * std::numbers::pi / 180.0;
            object.burial = 1.0;  // 1 mm of the bed is over it
            scene.objects = {object};
            CAPTURE(rough, surface, intersector, shape, heading_deg);
            Simulator covered(scene);
            check_same(pings(covered), expected);
          }
      }
}

TEST_CASE("what a session moves under the bed has no echo there, and has one where it is seen") {
  const Scene scene = scene_with_bed(false);
  Simulator session(scene);
  const std::vector<BinLayers> expected = pings(session);
  ShapeSize size;
  size.diameter_m = 0.4;
  const std::uint32_t instance = session.add({.mesh = body("sphere", size), .material = "steel"},
                                             {.position = {east_m, 0.0, -13.0}});
  CHECK(energy_of(pings(session)) > 1.003 * energy_of(expected));
  session.move(instance, {.position = {east_m, 0.0, -14.202}});
  check_same(pings(session), expected);
}

TEST_CASE("what lies just behind another thing does not glint") {
  ShapeSize size;
  size.diameter_m = 0.2;
  size.length_m = 0.6;
  const refine::TriangleMesh plate = upright_cells(0.3, [](int, int) { return true; }),
                             cylinder = body("cylinder", size), sphere = body("sphere", size);
  for (const auto& [mesh, front_m] : {std::pair{&plate, 0.0}, {&cylinder, 0.1}, {&sphere, 0.1}})
    for (const double gap_m : {0.005, 0.02})
      for (int i = -10; i <= 10; ++i) {
        Sonar sonar = wide_sonar(22.0);
        const double north_m = 0.05 * i;
        Body hidden{*mesh, nothing, 1.0, 0.0, north_m};
        hidden.hider = Hider{front_m + gap_m, {north_m - 0.8, -0.6}, {north_m + 0.8, 0.6}};
        CAPTURE(front_m, gap_m, north_m);
        CHECK(target_strength_db(echo_of(hidden, sonar, 20.0), sonar) < -60.0);
      }
}
