// A layered sea: the losses of a refracted or a straight echo of the bed, against the sonar
// equation of single rays.

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

TEST_CASE("a level bed's refracted echo has the sonar equation's level with the rays' own losses") {
  // Without (c_bed / c_sonar)^2 the first two are 0.18 and 0.42 dB too strong, the third too weak.
  struct Case {
    double sonar_mps, bed_mps;
  };
  const TemporaryFolder folder;
  for (const auto& [sonar_mps, at_bed_mps] :
       {Case{1525.0, 1493.0}, {1522.0, 1450.0}, {1450.0, 1500.0}}) {
    Scene scene = level_scene();
    scene.sea.absorption_db_per_km = 30.0;
    scene.sea.profile = {"step.csv", folder / "step.csv"};
    scene.sea.refraction = RefractionMode::full;
    std::ofstream(folder / "step.csv")
        << "depth_m,soundspeed_mps\n0," << sonar_mps << "\n8," << sonar_mps << "\n12," << at_bed_mps
        << "\n30," << at_bed_mps << '\n';
    const scatter::SoundSpeedProfile profile(
        {{0.0, sonar_mps}, {8.0, sonar_mps}, {12.0, at_bed_mps}, {30.0, at_bed_mps}});
    constexpr double depth_m = 4.0;
    const Sonar& sonar = scene.sonars.front();
    const double reference_mps = profile.mean_speed_mps(0.0, bed_m);
    const std::vector<double> measured_db = level_db(scene, depth_m);
    const scatter::Lambert shells(-14.0);
    for (const double range_m : {25.0, 35.0, 50.0, 65.0}) {
      scatter::SoundRay ray =
          scatter::find_eigenray(profile,
                                 {.source_depth_m = depth_m, .range_m = range_m, .depth_m = bed_m})
              .value();
      const double along = ray.point().along, snell_s_per_m = along / sonar_mps;
      while (ray.path_to_range_m(range_m) > ray.path_to_edge_m()) ray.advance(ray.path_to_edge_m());
      ray.advance(ray.path_to_range_m(range_m));
      // A line array's footprint: its width is the beam's at the launch angle; its length
      // follows from the pulse, since the two-way time grows with the ground range by twice
      // Snell's constant.
      const double width_m =
          range_m * 2.0 / 3.0 * reference_mps / sonar.frequency_hz / sonar.array_length_m / along;
      const double cell_m = 0.5 * sonar.pulse.effective_length_s() / snell_s_per_m;
      const double expected_db =
          sonar.source_level_db - 2.0 * (ray.loss_db() + 0.03 * ray.point().path_m) +
          scatter::to_db(shells.cross_section(std::asin(ray.point().down)) * width_m * cell_m);
      const double at = reference_mps * ray.point().time_s / sonar.bin_m() - 0.5;
      const auto bin = static_cast<std::size_t>(at);
      const double share = at - std::floor(at);
      CAPTURE(sonar_mps, at_bed_mps, range_m);
      CHECK(std::lerp(measured_db[bin], measured_db[bin + 1], share) ==
            Approx(expected_db).margin(0.03));
    }
  }
}

TEST_CASE("surface, multiples and earlier pings have the travel times of the cast") {
  // Fast water above, slow water below, the sonar at their border.
  const TemporaryFolder folder;
  constexpr double depth_m = 18.0, bed_at_m = 60.0;
  Scene scene = level_scene();
  scene.seafloor.depth_m = bed_at_m;
  scene.sonars.front().range_m = 120.0;
  scene.sonars.front().bins = 2400;
  scene.sonars.front().sector_low_rad = -0.6;
  scene.sonars.front().receiver.noise = false;
  scene.sea.state.wind_mps = 0.0;
  scene.sea.profile = {"step.csv", folder / "step.csv"};
  std::ofstream(folder / "step.csv")
      << "depth_m,soundspeed_mps\n0,1540\n18,1540\n22,1470\n60,1470\n";
  // The time of dz / c(z), in small steps.
  const auto time_s = [&](double from_m, double to_m) {
    double sum = 0.0;
    const double step_m = (to_m - from_m) / 1e5;
    for (int i = 0; i < 100000; ++i) {
      const double z = from_m + (i + 0.5) * step_m;
      sum += step_m / (z < 18.0 ? 1540.0 : z < 22.0 ? 1540.0 - 17.5 * (z - 18.0) : 1470.0);
    }
    return sum;
  };
  const double reference_mps = bed_at_m / time_s(0.0, bed_at_m);
  const double surface_m = reference_mps * time_s(0.0, depth_m),
               below_m = reference_mps * time_s(depth_m, bed_at_m), ping_m = 30.0;
  scene.track.ping_interval_s = 2.0 * ping_m / reference_mps;
  struct Case {
    const char* name;
    OtherPathsOptions arrivals;
    double straight_m, by_time_m;
  };
  for (const RefractionMode mode :
       {RefractionMode::off, RefractionMode::time_only, RefractionMode::full})
    for (const Case& of :
         {Case{"surface", {.surface = true}, depth_m, surface_m},
          Case{"bed and surface", {.multiples = true}, bed_at_m, below_m + surface_m},
          Case{"earlier",
               {.second_time_around = true},
               bed_at_m - depth_m - ping_m,
               below_m - ping_m}}) {
      scene.sea.refraction = mode;
      scene.arrivals = of.arrivals;
      Simulator simulator(scene);
      const EchoLine line = simulator.ping_numbered({.position = {0.0, 0.0, -depth_m}}, 0)[1];
      std::vector<double> added;
      for (std::size_t i = 0; i < line.bins.intensity.size(); ++i)
        added.push_back(double(line.bins.intensity[i]) - double(line.bins.intensity_mean[i]));
      std::size_t first = 1;  // the highest step
      for (std::size_t i = 1; i < added.size(); ++i)
        if (added[i] - added[i - 1] > added[first] - added[first - 1]) first = i;
      CAPTURE(of.name, static_cast<int>(mode));
      CHECK(double(line.bins.range_m[first]) ==
            Approx(mode == RefractionMode::off ? of.straight_m : of.by_time_m).margin(0.08));
    }
  CHECK(depth_m - surface_m > 0.5);
}

// Snell: in water whose speed falls with depth, rays that start upwards turn and come down beyond
// those that start level. What they reach of the bed ends with the ray that grazes the surface.
TEST_CASE("where rays bend down, the bed is seen and has its level as far as turning rays reach") {
  const TemporaryFolder folder;
  constexpr double depth_m = 6.0, bed_at_m = 12.0, surface_mps = 1520.0, per_s = -1.0;
  Scene scene = level_scene();
  scene.seafloor.depth_m = bed_at_m;
  scene.seafloor.extent_east_m = 420.0;
  scene.sea.absorption_db_per_km = 0.0;
  scene.sea.profile = {"falls.csv", folder / "falls.csv"};
  scene.sea.refraction = RefractionMode::full;
  std::ofstream(folder / "falls.csv") << "depth_m,soundspeed_mps\n0," << surface_mps << "\n20,"
                                      << surface_mps + 20.0 * per_s << '\n';
  Sonar& sonar = scene.sonars.front();
  sonar.range_m = 200.0;
  const scatter::SoundSpeedProfile profile(
      {{0.0, surface_mps}, {20.0, surface_mps + 20.0 * per_s}});
  const double reference_mps = profile.mean_speed_mps(0.0, bed_at_m);
  // Arcs of a circle with this radius about a place above the surface.
  const double radius_m = surface_mps / -per_s;
  const auto out_m = [&](double z_m) {  // from where the ray grazes the surface
    return std::sqrt(std::pow(radius_m, 2) - std::pow(radius_m - z_m, 2));
  };
  const double last_m = out_m(depth_m) + out_m(bed_at_m);
  const double level_m =
      std::sqrt(2.0 * (bed_at_m - depth_m) * radius_m);  // nearly, of the level ray
  REQUIRE(level_m < 0.7 * sonar.range_m);
  REQUIRE(last_m > sonar.range_m + 10.0);

  Simulator simulator(scene);
  const EchoLine line = simulator.ping_numbered({.position = {0.0, 0.0, -depth_m}}, 0)[1];
  CHECK(line.starved == 0);
  for (auto i = static_cast<std::size_t>(7.0 / sonar.bin_m()); i < line.bins.region.size(); ++i) {
    CAPTURE(line.bins.range_m[i]);
    REQUIRE(line.bins.region[i] == static_cast<std::uint32_t>(Region::seabed));
  }
  const scatter::Lambert shells(-14.0);
  for (const double range_m : {50.0, 100.0, 130.0, 145.0, 160.0, 175.0, 190.0}) {
    scatter::SoundRay ray =
        scatter::find_eigenray(profile,
                               {.source_depth_m = depth_m, .range_m = range_m, .depth_m = bed_at_m})
            .value();
    const double along = ray.point().along;
    const double snell_s_per_m = along / profile.speed_mps(depth_m);
    while (ray.path_to_range_m(range_m) > ray.path_to_edge_m()) ray.advance(ray.path_to_edge_m());
    ray.advance(ray.path_to_range_m(range_m));
    const double width_m =  // as above
        range_m * 2.0 / 3.0 * reference_mps / sonar.frequency_hz / sonar.array_length_m / along;
    const double cell_m = 0.5 * sonar.pulse.effective_length_s() / snell_s_per_m;
    const double expected_db =
        sonar.source_level_db - 2.0 * ray.loss_db() +
        scatter::to_db(shells.cross_section(std::asin(ray.point().down)) * width_m * cell_m);
    const auto bin = static_cast<std::size_t>(reference_mps * ray.point().time_s / sonar.bin_m());
    CAPTURE(range_m);
    CHECK(scatter::to_db(double(line.bins.intensity_mean[bin])) == Approx(expected_db).margin(0.1));
  }
}

// Snell: the ray that grazes the bed goes straight through water of one speed and then on a circle.
TEST_CASE("where rays bend up, the bed is seen up to the ray that grazes it, at every pose") {
  const TemporaryFolder folder;
  constexpr double bed_at_m = 50.0, gradient_at_m = 30.0, even_mps = 1495.0, per_s = 25.0 / 30.0;
  constexpr double bed_mps = even_mps + per_s * (bed_at_m - gradient_at_m);
  Scene scene = level_scene();
  scene.seafloor.depth_m = bed_at_m;
  scene.seafloor.extent_east_m = 800.0;
  scene.seafloor.cell_m = 1.0;
  scene.sea.absorption_db_per_km = 0.0;
  scene.sea.profile = {"rises.csv", folder / "rises.csv"};
  scene.sea.refraction = RefractionMode::full;
  std::ofstream(folder / "rises.csv") << "depth_m,soundspeed_mps\n0,1510\n15,1495\n30,1495\n"
                                      << "60,1520\n";
  Sonar& sonar = scene.sonars.front();
  sonar.frequency_hz = 100e3;
  sonar.range_m = 400.0;
  sonar.elevations = 2048;
  const scatter::SoundSpeedProfile profile(
      {{0.0, 1510.0}, {15.0, even_mps}, {gradient_at_m, even_mps}, {60.0, 1520.0}});
  const double reference_mps = profile.mean_speed_mps(0.0, bed_at_m);
  const double grazes_rad = std::acos(even_mps / bed_mps);
  Simulator simulator(scene);
  struct At {
    double depth_m, roll_rad, pitch_rad, within_m;
  };
  for (const At& at :
       {At{18.5, 0.0, 0.0, 2.0}, At{20.0, 0.0, 0.0, 2.0}, At{22.5, 0.0, 0.0, 2.0},
        At{23.5, 0.0, 0.0, 2.0}, At{20.0, 0.0035, 0.0, 2.0}, At{20.0, -0.07, 0.0, 2.0},
        At{20.0, 0.0, 0.05, 5.0}, At{20.0, 0.04, -0.1, 5.0}}) {
    CAPTURE(at.depth_m, at.roll_rad, at.pitch_rad);
    const double last_s = (gradient_at_m - at.depth_m) / std::sin(grazes_rad) / even_mps +
                          std::acosh(bed_mps / even_mps) / per_s;
    const EchoLine line = simulator.ping_numbered(
        {.position = {0.0, 0.0, -at.depth_m}, .roll_rad = at.roll_rad, .pitch_rad = at.pitch_rad},
        0)[1];
    std::size_t last = line.bins.region.size() - 1;
    while (line.bins.region[last] != static_cast<std::uint32_t>(Region::seabed)) --last;
    const double short_m = reference_mps * last_s - double(line.bins.range_m[last]);
    CHECK(short_m < at.within_m);
    CHECK(short_m > -2.0 * sonar.bin_m());
  }
}

TEST_CASE("under a cast a bin's place is on the bed, and its angle that of the ray to this place") {
  const TemporaryFolder folder;
  const std::vector<scatter::SoundSpeedSample> samples{{0, 1520},  {6, 1518},  {9, 1500},
                                                       {14, 1490}, {20, 1488}, {40, 1487}};
  const scatter::SoundSpeedProfile profile(samples);
  Scene scene = level_scene();
  scene.sea.profile = {"cast.csv", folder / "cast.csv"};
  std::ofstream cast(folder / "cast.csv");
  cast << "depth_m,soundspeed_mps\n";
  for (const scatter::SoundSpeedSample& at : samples)
    cast << at.depth_m << ',' << at.sound_speed_mps << '\n';
  cast.close();
  scene.seafloor.kind = SeafloorKind::mesh;
  scene.seafloor.mesh = {"bed.obj", folder / "bed.obj"};
  Sonar& sonar = scene.sonars.front();
  sonar.elevations = 1024;
  sonar.range_m = 60.0;
  constexpr double sonar_m = 8.0;
  for (const double slope : {0.0, 0.15, -0.1}) {
    // A plane of faces that are much longer than a bin.
    const Eigen::Vector3d upwards(-slope, -0.5 * slope, 1.0);
    std::ofstream bed(folder / "bed.obj");
    bed.precision(9);
    constexpr int columns = 40, rows = 12;
    constexpr double cell_m = 8.0;
    for (int i = 0; i < rows * columns; ++i) {
      const int column = i % columns, row = i / columns;
      const double x_m = (column - 0.5 * (columns - 1)) * cell_m;
      const double y_m = (row - 0.5 * (rows - 1)) * cell_m;
      bed << "v " << x_m << ' ' << y_m << ' ' << -20.0 - upwards.x() * x_m - upwards.y() * y_m
          << '\n';
    }
    for (int a = 1; a < (rows - 1) * columns; ++a)
      if (a % columns != 0)
        bed << "f " << a << ' ' << a + 1 << ' ' << a + 1 + columns << "\nf " << a << ' '
            << a + 1 + columns << ' ' << a + columns << '\n';
    bed.close();
    for (const RefractionMode mode : {RefractionMode::time_only, RefractionMode::full}) {
      scene.sea.refraction = mode;
      Simulator simulator(scene);
      const EchoLine line = simulator.ping_numbered({.position = {0.0, 0.0, -sonar_m}}, 0)[1];
      double farthest_off_m = 0.0, most_off_deg = 0.0;
      int looked = 0;
      for (std::size_t i = 0; i < line.bins.region.size(); ++i) {
        if (!is(line, i, Region::seabed) || double(line.bins.range_m[i]) < 20.0) continue;
        const Eigen::Vector3d place(line.bins.x_m[i], line.bins.y_m[i], line.bins.z_m[i]);
        farthest_off_m =
            std::max(farthest_off_m, std::abs(upwards.dot(place) + 20.0) / upwards.norm());
        Eigen::Vector3d travel(place.x(), place.y(), place.z() + sonar_m);
        if (mode == RefractionMode::full) {
          const double out_m = travel.head<2>().norm();
          const auto arrived = scatter::find_near_eigenray(
              profile, {.source_depth_m = sonar_m, .range_m = out_m, .depth_m = -place.z()});
          REQUIRE(arrived);
          travel.head<2>() *= arrived->ray.point().along / out_m;
          travel.z() = -arrived->ray.point().down;
        }
        const double grazing_rad =
            std::asin(-upwards.dot(travel) / (upwards.norm() * travel.norm()));
        most_off_deg =
            std::max(most_off_deg, std::abs(grazing_rad - double(line.bins.grazing_rad[i])) *
                                       180.0 / std::numbers::pi);
        ++looked;
      }
      CAPTURE(slope, static_cast<int>(mode));
      CHECK(looked == 1000);
      CHECK(farthest_off_m < 1e-3);
      CHECK(most_off_deg < 0.02);
    }
  }
}
