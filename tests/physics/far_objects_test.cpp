// The echo of an object does not depend on where in the seabed it lies, although the vertices that
// rays meet are floats about the seabed's middle.

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "physics/body_in_water.h"
#include "support/beds.h"
#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr double away_m = 50.0, sonar_m = 20.0;

/// Far above a level, nearly silent bed that reaches 600 km to all sides.
Scene scene_in_water() {
  static const TemporaryFolder folder;
  Scene scene;
  scene.seafloor.kind = SeafloorKind::mesh;
  scene.seafloor.mesh = {"bed.off", folder / "bed.off"};
  write_text(folder / "bed.off",
             "OFF\n4 2 0\n-6e5 -6e5 -80\n6e5 -6e5 -80\n6e5 6e5 -80\n-6e5 6e5 -80\n"
             "3 0 1 2\n3 0 2 3\n");
  scene.sea.sound_speed_mps = 1500.0;
  scene.sea.absorption_db_per_km = 0.0;
  scene.speckle = scene.texture = false;
  Material quiet{.name = "quiet", .model = "lambert"};
  quiet.lambert_mu_db = -100.0;
  Material rigid{.name = "rigid", .model = "solid", .like = "steel"};
  rigid.specular = 0.999;
  rigid.diffuse_db = -100.0;
  rigid.lobe_width_rad = 0.0;
  scene.materials = {quiet, rigid};
  scene.seafloor.material = "quiet";
  Sonar& sonar = scene.sonars.front();
  sonar = plain_sonar();
  sonar.frequency_hz = 400e3;
  sonar.array_length_m = 0.1;
  sonar.pulse.bandwidth_hz = 10e3;
  sonar.source_level_db = 0.0;
  sonar.range_m = 60.0;
  sonar.bins = 800;
  return scene;
}

/// The target strength of what is around away_m to the east of a place as far to the east as to the
/// north.
double strength_db(Simulator& simulator, double far_m) {
  const BinLayers bins = simulator.ping_numbered({.position = {far_m, far_m, -sonar_m}}, 0)[1].bins;
  double sum = 0.0;
  for (std::size_t i = 0; i < bins.range_m.size(); ++i)
    if (std::abs(double(bins.range_m[i]) - away_m) < 8.0)
      sum += double(bins.intensity_mean[i]) * std::pow(double(bins.range_m[i]), 4);
  return scatter::to_db(sum);  // a bin is as long as a range cell
}

double strength_db(ObjectOptions object, double far_m) {
  Scene scene = scene_in_water();
  object.material = "rigid";
  object.east_m = far_m + away_m;
  object.north_m = far_m;
  object.height_m = 80.0 - sonar_m;
  scene.objects = {object};
  Simulator simulator(scene, {.threads = 1});
  return strength_db(simulator, far_m);
}

constexpr double places_m[] = {1e3, 2e3, 1e4, 1e5, 5e5};

}  // namespace

TEST_CASE("a smooth sphere of fine facets has a^2 / 4 wherever on the seabed it lies") {
  constexpr double radius_m = 0.15;
  ObjectOptions ball{.shape = "sphere"};
  ball.size.diameter_m = 2.0 * radius_m;
  ball.size.facet_m = 0.004;
  const double expected_db = scatter::to_db(0.25 * radius_m * radius_m);
  CHECK(strength_db(ball, 0.0) == Approx(expected_db).margin(0.2));
  for (const double far_m : places_m) {
    CAPTURE(far_m);
    CHECK(strength_db(ball, far_m) == Approx(expected_db).margin(0.2));
    CHECK(strength_db(ball, -far_m) == Approx(expected_db).margin(0.2));
  }
}

// Parts of a family hide one another, as rays find that meet vertices in floats: up to 10 km away
// from the middle these are the same.
TEST_CASE("the glints of every shape are the same wherever on the seabed it lies") {
  for (const ShapeKind& kind : shape_kinds()) {
    ObjectOptions object{.shape = std::string(kind.name)};
    if (kind.along_path) object.path = {{0.0, -4.0}, {0.0, 4.0}};
    const double expected_m2 = scatter::from_db(strength_db(object, 0.0));
    for (const double far_m : places_m) {
      if (kind.family && far_m > 1e4) continue;
      CAPTURE(kind.name, far_m);
      // Some have no glint from there, and next to nothing else.
      CHECK(scatter::from_db(strength_db(object, far_m)) ==
            Approx(expected_m2).epsilon(0.05).margin(1e-9));
    }
  }
}

TEST_CASE("what a session moves has the same glint wherever on the seabed it is") {
  ShapeSize size;
  size.diameter_m = 0.3;
  size.facet_m = 0.004;
  Simulator session(scene_in_water());
  const auto at = [](double far_m) {
    return Pose{.position = {far_m + away_m, far_m, -sonar_m}, .heading_rad = 0.4};
  };
  const std::uint32_t ball =
      session.add({.mesh = body("sphere", size), .material = "rigid"}, at(0.0));
  const double expected_db = strength_db(session, 0.0);
  CHECK(expected_db == Approx(scatter::to_db(0.25 * 0.15 * 0.15)).margin(0.2));
  for (const double far_m : places_m) {
    CAPTURE(far_m);
    session.move(ball, at(far_m));
    CHECK(strength_db(session, far_m) == Approx(expected_db).margin(0.05));
  }
}
