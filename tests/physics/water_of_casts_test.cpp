// The water of a cast along the path and at the bed, and the echoes of objects in it.

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

TEST_CASE("a bed scatters as under the water that lies on it, not under the mean of the cast") {
  const TemporaryFolder folder;
  std::ofstream(folder / "layers.csv")
      << "depth_m,soundspeed_mps\n0,1522\n12,1522\n14,1450\n30,1450\n";
  Scene scene = level_scene();
  scene.sea.profile = {"layers.csv", folder / "layers.csv"};
  scene.sea.refraction = RefractionMode::full;
  const auto ping = [&](const std::string& material) {
    scene.seafloor.material = material;
    Simulator simulator(scene);
    return simulator.ping_numbered({.position = {0.0, 0.0, -10.0}}, 0)[1].bins;
  };
  const BinLayers sand = ping("medium sand"), shells = ping("shells");
  const auto material = backscatter_of(material_named("medium sand", {}),
                                       scene.sonars.front().frequency_hz, 1450.0, 0.0);
  for (const double range_m : {20.0, 30.0, 45.0}) {
    const auto bin = static_cast<std::size_t>(range_m / scene.sonars.front().bin_m());
    const double grazing_rad = sand.grazing_rad[bin];
    CAPTURE(range_m, grazing_rad);
    CHECK(scatter::to_db(sand.intensity_mean[bin] / shells.intensity_mean[bin]) ==
          Approx(scatter::to_db(material->cross_section(grazing_rad) /
                                scatter::Lambert(-14.0).cross_section(grazing_rad)))
              .margin(0.01));
  }
}

TEST_CASE("absorption follows the cast's temperatures along the path") {
  // 400 kHz, 35 psu: Francois and Garrison's 94 dB/km at 4 degrees, 124 at 20.
  CHECK(scatter::absorption_db_per_m({.temperature_c = 4.0}, 20.0, 400e3) ==
        Approx(0.094).margin(5e-4));
  CHECK(scatter::absorption_db_per_m({.temperature_c = 20.0}, 4.0, 400e3) ==
        Approx(0.124).margin(5e-4));
  const TemporaryFolder folder;
  const Sea2 sea;
  Scene scene = level_scene();
  scene.sea.profile = sea.cast(folder);
  const scatter::SoundSpeedProfile profile = sea.profile();
  for (const RefractionMode mode :
       {RefractionMode::off, RefractionMode::time_only, RefractionMode::full})
    for (const double depth_m : {3.0, 10.0, 14.0}) {  // in the warm, between, and in the cold
      scene.sea.refraction = mode;
      scene.sea.absorption_db_per_km.reset();
      const std::vector<double> absorbed_db = level_db(scene, depth_m);
      scene.sea.absorption_db_per_km = 0.0;
      const std::vector<double> lossless_db = level_db(scene, depth_m);
      const double reference_mps = profile.mean_speed_mps(0.0, bed_m);
      for (const double range_m : {20.0, 45.0, 70.0}) {
        // Summed in short steps along the ray, or the straight line, in water of known temperature.
        double expected_db = 0.0, t_s = 0.0;
        if (mode == RefractionMode::full) {
          scatter::SoundRay ray =
              scatter::find_eigenray(
                  profile, {.source_depth_m = depth_m, .range_m = range_m, .depth_m = bed_m})
                  .value();
          while (ray.point().range_m < range_m) {
            const scatter::SoundRayPoint from = ray.point();
            ray.advance(std::min({0.01, ray.path_to_edge_m(), ray.path_to_range_m(range_m)}));
            expected_db +=
                (ray.point().path_m - from.path_m) *
                sea.absorption_db_per_m(0.5 * (from.depth_m + ray.point().depth_m), 400e3);
            if (range_m - ray.point().range_m < 1e-9) break;
          }
          t_s = ray.point().time_s;
        } else {
          constexpr int steps = 2000;
          const double path_m = std::hypot(range_m, bed_m - depth_m);
          for (int i = 0; i < steps; ++i) {
            const double z = depth_m + (bed_m - depth_m) * (i + 0.5) / steps;
            expected_db += path_m / steps * sea.absorption_db_per_m(z, 400e3);
            t_s +=
                path_m / steps / (mode == RefractionMode::off ? reference_mps : sea.speed_mps(z));
          }
        }
        const auto bin =
            static_cast<std::size_t>(reference_mps * t_s / scene.sonars.front().bin_m());
        CAPTURE(static_cast<int>(mode), depth_m, range_m);
        CHECK(lossless_db[bin] - absorbed_db[bin] == Approx(2.0 * expected_db).margin(0.04));
      }
    }
}

TEST_CASE("the echo of an object has the losses and the time of the bent ray that leads to it") {
  struct Case {
    double sonar_mps, bed_mps, sonar_m, ball_m, east_m;  // depths
  };
  const TemporaryFolder folder;
  for (const Case& c : {Case{1500, 1490, 4, 19, 40},
                        {1520, 1480, 4, 19, 70},
                        {1490, 1510, 4, 19, 50},
                        {1520, 1480, 16, 5, 55}}) {
    Scene scene = dark_scene();
    scene.sea.absorption_db_per_km = 0.0;
    scene.sea.profile = {"step.csv", folder / "step.csv"};
    std::ofstream(folder / "step.csv")
        << "depth_m,soundspeed_mps\n0," << c.sonar_mps << "\n8," << c.sonar_mps << "\n12,"
        << c.bed_mps << "\n30," << c.bed_mps << '\n';
    const scatter::SoundSpeedProfile profile(
        {{0, c.sonar_mps}, {8, c.sonar_mps}, {12, c.bed_mps}, {30, c.bed_mps}});
    constexpr double radius_m = 0.15;
    scene.objects = {small_ball(c.east_m, bed_m - c.ball_m - radius_m)};
    scatter::SoundRay ray =
        scatter::find_eigenray(
            profile, {.source_depth_m = c.sonar_m, .range_m = c.east_m, .depth_m = c.ball_m})
            .value();
    while (ray.path_to_range_m(c.east_m) > ray.path_to_edge_m()) ray.advance(ray.path_to_edge_m());
    ray.advance(ray.path_to_range_m(c.east_m));
    const double front_s = ray.point().time_s - radius_m / ray.point().sound_speed_mps;
    const double straight_m = std::hypot(c.east_m, c.ball_m - c.sonar_m);
    const Peak straight = peak_of(scene, c.sonar_m);
    scene.sea.refraction = RefractionMode::full;
    const Peak bent = peak_of(scene, c.sonar_m);
    CAPTURE(c.sonar_mps, c.bed_mps, c.sonar_m, c.east_m);
    // A ball of facets has its target strength within 0.2 dB from every side.
    CHECK(straight.energy_db - bent.energy_db ==
          Approx(2.0 * (ray.loss_db() - 20.0 * std::log10(straight_m))).margin(0.2));
    CHECK(
        bent.range_m ==
        Approx(profile.mean_speed_mps(0.0, bed_m) * front_s).margin(scene.sonars.front().bin_m()));
  }
}

TEST_CASE("the water absorbs the echo of an object along the way that the sound takes") {
  const TemporaryFolder folder;
  const Sea2 sea;
  constexpr double east_m = 70.0, sonar_m = 4.0, ball_m = 15.0;
  Scene scene = dark_scene();
  scene.sea.profile = sea.cast(folder);
  scene.objects = {small_ball(east_m, bed_m - ball_m - 0.15)};
  const scatter::SoundSpeedProfile profile = sea.profile();
  const auto at = [&](double depth_m) { return sea.absorption_db_per_m(depth_m, 400e3); };
  for (const RefractionMode mode :
       {RefractionMode::off, RefractionMode::time_only, RefractionMode::full}) {
    // Summed in short steps, as above.
    double expected_db = 0.0;
    if (mode == RefractionMode::full) {
      scatter::SoundRay ray =
          scatter::find_eigenray(profile,
                                 {.source_depth_m = sonar_m, .range_m = east_m, .depth_m = ball_m})
              .value();
      while (ray.point().range_m < east_m) {
        const double from_m = ray.point().path_m;
        ray.advance(std::min({0.01, ray.path_to_edge_m(), ray.path_to_range_m(east_m)}));
        expected_db += (ray.point().path_m - from_m) * at(ray.point().depth_m);
        if (east_m - ray.point().range_m < 1e-9) break;
      }
    } else {
      constexpr int steps = 2000;
      for (int i = 0; i < steps; ++i)
        expected_db += std::hypot(east_m, ball_m - sonar_m) / steps *
                       at(sonar_m + (ball_m - sonar_m) * (i + 0.5) / steps);
    }
    scene.sea.refraction = mode;
    scene.sea.absorption_db_per_km.reset();
    const double absorbed_db = peak_of(scene, sonar_m).energy_db;
    scene.sea.absorption_db_per_km = 0.0;
    CAPTURE(static_cast<int>(mode));
    CHECK(peak_of(scene, sonar_m).energy_db - absorbed_db ==
          Approx(2.0 * expected_db).margin(0.05));
  }
}

TEST_CASE("an absorption that the scene gives moves no echo of an object") {
  const TemporaryFolder folder;
  Scene scene = dark_scene();
  scene.sea.profile = Sea2().cast(folder);
  scene.objects = {small_ball(60.0, 10.0)};
  for (const RefractionMode mode :
       {RefractionMode::off, RefractionMode::time_only, RefractionMode::full}) {
    CAPTURE(static_cast<int>(mode));
    scene.sea.refraction = mode;
    scene.sea.absorption_db_per_km.reset();
    const double followed_m = peak_of(scene, 4.0).range_m;
    scene.sea.absorption_db_per_km = 100.0;
    CHECK(peak_of(scene, 4.0).range_m == followed_m);
  }
}

TEST_CASE("a cast with speeds impossible at the scene's salinity gives a warning") {
  const TemporaryFolder folder;
  std::ofstream(folder / "lake.csv") << "depth_m,soundspeed_mps\n0,1421\n30,1421\n";
  Scene scene = level_scene();
  scene.sea.profile = {"lake.csv", folder / "lake.csv"};
  const auto told = [&] {
    const Simulator simulator(scene);
    return std::ranges::count_if(simulator.warnings(), [](const std::string& warning) {
      return warning.starts_with("lake.csv") && warning.find("sea.salinity_psu") != warning.npos;
    });
  };
  CHECK(told() == 1);
  scene.sea.water.salinity_psu = 0.0;  // a lake at 4 degrees
  CHECK(told() == 0);
  scene.sea.water.salinity_psu = 35.0;
  scene.sea.absorption_db_per_km = 50.0;
  CHECK(told() == 0);
}
