// A bed that rises to the sonar's height and above it.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>

#include "support/beds.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// Writes a bed as a mesh of squares, 6 m wide or one cell.
void write_bed(const std::filesystem::path& path, double from_m, double until_m, double cell_m,
               const std::function<double(double x_m)>& height_m) {
  const int columns = static_cast<int>(std::lround((until_m - from_m) / cell_m)) + 1;
  const int rows = static_cast<int>(std::ceil(6.0 / cell_m)) + 1;
  std::ofstream file(path);
  file.precision(9);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const double x_m = from_m + column * cell_m;
      file << "v " << x_m << ' ' << (row - 0.5 * (rows - 1)) * cell_m << ' ' << height_m(x_m)
           << '\n';
    }
  for (int row = 0; row + 1 < rows; ++row)
    for (int column = 0; column + 1 < columns; ++column) {
      const int a = row * columns + column + 1, b = a + 1, c = a + columns, d = c + 1;
      file << "f " << a << ' ' << b << ' ' << d << "\nf " << a << ' ' << d << ' ' << c << '\n';
    }
}

EchoLine starboard_of(const Scene& scene, double depth_m) {
  Simulator simulator(scene);
  return simulator.ping_numbered({.position = {0.0, 0.0, -depth_m}}, 0)[1];
}

Scene scene_over(const TemporaryFolder& folder) {
  Scene scene;
  scene.speckle = false;
  scene.sea.absorption_db_per_km = 0.0;
  scene.seafloor.kind = SeafloorKind::mesh;
  scene.seafloor.mesh = {"bed.obj", folder / "bed.obj"};
  scene.sonars.front() = plain_sonar();
  return scene;
}

}  // namespace

// A line array's echo of a plane depends on its distance from the plane only.
TEST_CASE("a plane that rises above the sonar has a level plane's echo up to the last bin") {
  const TemporaryFolder folder;
  Scene scene = scene_over(folder);
  Sonar& sonar = scene.sonars.front();
  constexpr double depth_m = 30.0, distance_m = 5.0;
  struct Case {
    double slope_rad, range_m;
  };
  for (const auto& [slope_rad, range_m] :
       {Case{0.0, 200.0}, {0.03, 200.0}, {0.1, 100.0}, {0.16, 150.0}}) {
    CAPTURE(slope_rad);
    sonar.range_m = range_m;
    sonar.bins = static_cast<int>(10.0 * range_m);
    const auto plane_at = [&](double angle_rad) {
      write_bed(folder / "bed.obj", -250.0, 250.0, 500.0, [&](double x_m) {
        return -depth_m - distance_m / std::cos(angle_rad) + std::tan(angle_rad) * x_m;
      });
      return starboard_of(scene, depth_m);
    };
    const EchoLine level = plane_at(0.0), slope = plane_at(slope_rad);
    CHECK(slope.starved == 0);
    double worst_db = 0.0;
    for (auto i = static_cast<std::size_t>(1.5 * distance_m / sonar.bin_m());
         i < slope.bins.region.size(); ++i) {
      REQUIRE(is(slope, i, Region::seabed));
      worst_db = std::max(worst_db, std::abs(scatter::to_db(double(slope.bins.intensity_mean[i]) /
                                                            double(level.bins.intensity_mean[i]))));
    }
    CHECK(worst_db < 0.05);
  }
}

TEST_CASE("the shadows of a rough slope that rises above the sonar are those of many more rays") {
  const TemporaryFolder folder;
  Scene scene = scene_over(folder);
  Sonar& sonar = scene.sonars.front();
  sonar.range_m = 90.0;
  sonar.bins = 900;
  // Ridges 5 m apart whose far sides are hidden beyond some 30 m, and smaller ones on them.
  write_bed(folder / "bed.obj", -100.0, 100.0, 0.25, [](double x_m) {
    constexpr double turn = 2.0 * std::numbers::pi;
    return -35.0 + 0.2 * x_m + 0.2 * std::sin(turn * x_m / 5.0) + 0.02 * std::sin(turn * x_m / 1.1);
  });
  const EchoLine usual = starboard_of(scene, 30.0);
  sonar.elevations = 32 * sonar.elevations;
  const EchoLine dense = starboard_of(scene, 30.0);
  int shadow = 0, false_shadow = 0, lost_shadow = 0;
  for (std::size_t i = 0; i < usual.bins.region.size(); ++i) {
    shadow += is(dense, i, Region::shadow);
    false_shadow += is(usual, i, Region::shadow) && is(dense, i, Region::seabed);
    lost_shadow += is(usual, i, Region::seabed) && is(dense, i, Region::shadow);
  }
  CAPTURE(shadow, false_shadow, lost_shadow);
  CHECK(shadow > 200);
  CHECK(false_shadow < 20);
  CHECK(lost_shadow < 20);
}
