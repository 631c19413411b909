// A layered sea: the losses of a refracted or a straight echo, against the sonar equation of single
// rays.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "support/beds.h"
#include "support/catch.h"
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

namespace {

constexpr double bed_m = 22.0;

/// Water with one temperature above 8 m and another below 12 m, and a cast through it.
struct Sea2 {
  double warm_c = 20.0, cold_c = 4.0;

  scatter::SeaWater water(double depth_m) const {
    const double share = std::clamp((depth_m - 8.0) / 4.0, 0.0, 1.0);
    return {.temperature_c = warm_c + share * (cold_c - warm_c)};
  }
  double speed_mps(double depth_m) const {
    return scatter::sound_speed_mps(water(depth_m), depth_m);
  }
  double absorption_db_per_m(double depth_m, double frequency_hz) const {
    return scatter::absorption_db_per_m(water(depth_m), depth_m, frequency_hz);
  }
  scatter::SoundSpeedProfile profile() const {
    std::vector<scatter::SoundSpeedSample> samples;
    for (double z = 0.0; z <= 30.0; z += 0.25) samples.push_back({z, speed_mps(z)});
    return scatter::SoundSpeedProfile(std::move(samples));
  }
  InputFile cast(const TemporaryFolder& folder) const {
    std::ofstream file(folder / "cast.csv");
    file.precision(12);
    file << "depth_m,soundspeed_mps\n";
    for (double z = 0.0; z <= 30.0; z += 0.25) file << z << ',' << speed_mps(z) << '\n';
    return {"cast.csv", folder / "cast.csv"};
  }
};

Scene level_scene() {
  Scene scene;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.seafloor.depth_m = bed_m;
  scene.seafloor.extent_east_m = 240.0;
  scene.seafloor.extent_north_m = 60.0;
  scene.seafloor.cell_m = 0.5;
  scene.seafloor.material = "shells";  // Lambert's law
  scene.speckle = false;
  scene.sonars.front() = plain_sonar();
  scene.sonars.front().range_m = 100.0;
  return scene;
}

/// A smooth steel ball that a few planes of the fan meet.
ObjectOptions small_ball(double east_m, double height_m) {
  ObjectOptions ball{.shape = "sphere", .material = "steel"};
  ball.size.diameter_m = 0.3;
  ball.east_m = east_m;
  ball.height_m = height_m;
  return ball;
}

/// The range of the strongest echo, and the energy next to it, which is that of an object on its
/// own over a dark bed.
struct Peak {
  double range_m, energy_db;
};
Peak peak_of(const Scene& scene, double depth_m) {
  constexpr double reach_m = 0.5;
  Simulator simulator(scene);
  const EchoLine line = simulator.ping_numbered({.position = {0.0, 0.0, -depth_m}}, 0)[1];
  const std::vector<float>& all = line.bins.intensity_mean;
  const auto at = static_cast<std::size_t>(std::ranges::max_element(all) - all.begin());
  Peak peak{double(line.bins.range_m[at]), 0.0};
  double energy = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (std::abs(double(line.bins.range_m[i]) - peak.range_m) < reach_m) energy += double(all[i]);
  peak.energy_db = scatter::to_db(energy);
  return peak;
}

/// A level bed that returns next to nothing.
Scene dark_scene() {
  Scene scene = level_scene();
  Material dark{.name = "dark", .model = "lambert"};
  dark.lambert_mu_db = -100.0;
  scene.materials = {dark};
  scene.seafloor.material = "dark";
  scene.sonars.front().sector_low_rad = -0.6;
  return scene;
}

std::vector<double> level_db(const Scene& scene, double depth_m) {
  Simulator simulator(scene);
  std::vector<double> all;
  for (const float intensity :
       simulator.ping_numbered({.position = {0.0, 0.0, -depth_m}}, 0)[1].bins.intensity_mean)
    all.push_back(scatter::to_db(std::max(double(intensity), 1e-30)));
  return all;
}

}  // namespace

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

TEST_CASE("with straight rays the echo's spreading is right in water of constant gradient") {
  // There a wave from a point spreads over c_1 c_2 sinh^2(g t) / g^2, the geometric mean of both
  // ways, with cosh(g t) = 1 + g^2 s^2 / (2 c_1 c_2). That is the straight line's s^2 up to the
  // second order of the gradient, so a factor (c_bed / c_sonar)^2 would be wrong here.
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
      const double x_m = (i % columns - 0.5 * (columns - 1)) * cell_m;
      const double y_m = (i / columns - 0.5 * (rows - 1)) * cell_m;
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
