// Straight rays under a cast: travel times and spreading.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "support/beds.h"
#include "support/catch.h"
#include "support/layered_sea.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/eigenray.h>
#include <ensonify/scatter/sea_water.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

TEST_CASE("with straight rays the echo's spreading is right in water of constant gradient") {
  // In such water a wave from a point spreads over c_1 c_2 sinh^2(g t) / g^2 (the geometric mean of
  // the way out and the way back). The travel time t follows from cosh(g t) = 1 + g^2 s^2 / (2 c_1
  // c_2), where s is the straight distance. The result is s^2 (1 + g^2 s^2 / (4 c_1 c_2)): it has
  // no term of first order in the gradient g. The factor (c_bed / c_sonar)^2 has one, so it would
  // be wrong here.
  struct Case {
    double sonar_mps, bed_mps;
  };
  constexpr double depth_m = 4.0;
  const TemporaryFolder folder;
  for (const auto& [sonar_mps, at_bed_mps] : {Case{1525.0, 1493.0}, {1522.0, 1450.0}}) {
    const double gradient_per_s = (at_bed_mps - sonar_mps) / (bed_m - depth_m);
    const double top_mps = sonar_mps - gradient_per_s * depth_m;
    const double at_30_m_mps = top_mps + 30.0 * gradient_per_s;
    Scene scene = level_scene();
    Material even{.name = "even", .model = "gsab"};  // the same at all angles
    even.gsab_lambert_db = -25.0;
    even.gsab_lambert_exponent = 0.0;
    scene.materials = {even};
    scene.seafloor.material = "even";
    scene.sea.absorption_db_per_km = 0.0;
    scene.sea.refraction = RefractionMode::time_only;
    scene.sea.profile = {"slope.csv", folder / "slope.csv"};
    std::ofstream file(folder / "slope.csv");
    file.precision(12);
    file << "depth_m,soundspeed_mps\n0," << top_mps << "\n30," << at_30_m_mps << '\n';
    file.close();
    const scatter::SoundSpeedProfile profile({{0.0, top_mps}, {30.0, at_30_m_mps}});
    const double reference_mps = profile.mean_speed_mps(0.0, bed_m);
    const double mean_mps = profile.mean_speed_mps(depth_m, bed_m);
    const Sonar& sonar = scene.sonars.front();
    const std::vector<double> measured_db = level_db(scene, depth_m);
    for (const double range_m : {15.0, 25.0, 35.0, 50.0}) {
      const double straight_m = std::hypot(range_m, bed_m - depth_m);
      const double product = sonar_mps * at_bed_mps;
      const double gt =
          std::acosh(1.0 + std::pow(gradient_per_s * straight_m, 2.0) / (2.0 * product));
      const double spreading_m2 = product * std::pow(std::sinh(gt) / gradient_per_s, 2.0);
      const double width_m =
          straight_m * 2.0 / 3.0 * reference_mps / sonar.frequency_hz / sonar.array_length_m;
      const double cell_m =
          0.5 * mean_mps * sonar.pulse.effective_length_s() * straight_m / range_m;
      const double expected_db = sonar.source_level_db - 2.0 * scatter::to_db(spreading_m2) - 25.0 +
                                 scatter::to_db(width_m * cell_m);
      const double at = reference_mps * straight_m / mean_mps / sonar.bin_m() - 0.5;
      const auto bin = static_cast<std::size_t>(at);
      CAPTURE(sonar_mps, at_bed_mps, range_m);
      CHECK(std::lerp(measured_db[bin], measured_db[bin + 1], at - std::floor(at)) ==
            Approx(expected_db).margin(0.1));
    }
  }
}

TEST_CASE("straight rays with a cast's time see a level bed's facets as level") {
  // Facets that turn in straightened space make a saw of the level, with the facets' period.
  const TemporaryFolder folder;
  Scene scene = level_scene();
  scene.seafloor.cell_m = 1.0;
  scene.sea.absorption_db_per_km = 0.0;
  scene.sea.profile = {"step.csv", folder / "step.csv"};
  std::ofstream(folder / "step.csv")
      << "depth_m,soundspeed_mps\n0,1525\n12,1525\n16,1450\n30,1450\n";
  const auto roughness_db = [&](RefractionMode mode) {
    scene.sea.refraction = mode;
    const std::vector<double> level = level_db(scene, 10.0);
    const double bin_m = scene.sonars.front().bin_m();
    double worst_db = 0.0;
    for (auto i = static_cast<std::size_t>(20.0 / bin_m); i + 40 < level.size(); ++i)
      worst_db = std::max(worst_db, std::abs(level[i] - 0.5 * (level[i - 8] + level[i + 8])));
    return worst_db;
  };
  CHECK(roughness_db(RefractionMode::time_only) < roughness_db(RefractionMode::off) + 0.005);
}

TEST_CASE("with straight rays a cast leaves no end of the range without an echo") {
  // Sound that is faster on its way than the ranges assume comes from farther than the range.
  TemporaryFolder folder;
  std::ofstream(folder / "cast.csv") << "depth_m,soundspeed_mps\n0,1450\n4,1450\n6,1540\n30,1540\n";
  Scene scene = level_scene();
  scene.sea.profile = {"cast.csv", folder / "cast.csv"};
  scene.sea.refraction = RefractionMode::time_only;
  scene.run.surface = GENERATE("static", "footprint", "refined");
  Simulator simulator(scene);
  for (const EchoLine& line : simulator.ping_numbered({.position = {0.0, 0.0, -12.0}}, 0)) {
    const std::vector<std::uint32_t>& regions = line.bins.region;
    CHECK(std::ranges::count(regions, static_cast<std::uint32_t>(Region::shadow)) == 0);
    CHECK(regions.back() == static_cast<std::uint32_t>(Region::seabed));
    CHECK(line.bins.intensity_mean.back() > 0.0f);
  }
}
