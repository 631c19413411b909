// The echoes of things that are buried in mud, against the sonar equation with the losses at the
// bed and in the mud.

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>
#include <vector>

#include "support/beds.h"
#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/sediment.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;
using std::numbers::pi;

namespace {

constexpr double sand_m = 20.0, sonar_depth_m = 10.0, target_east_m = 12.0, water_mps = 1500.0;

Scene muddy_scene(const char* sediment, double frequency_hz) {
  Scene scene;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.seafloor.depth_m = sand_m;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 80.0;
  scene.seafloor.cell_m = 1.0;
  scene.seafloor.material = sediment;
  scene.seafloor.penetration_m = 1.0;
  scene.sea.sound_speed_mps = water_mps;
  scene.sea.absorption_db_per_km = 0.0;
  scene.speckle = false;
  Sonar& sonar = scene.sonars.front();
  sonar = plain_sonar();
  sonar.frequency_hz = frequency_hz;
  sonar.array_length_m = 25e3 / frequency_hz;  // the beam is 0.06 rad wide
  sonar.pulse.bandwidth_hz = 10e3;
  sonar.range_m = 30.0;
  sonar.bins = 1200;
  return scene;
}

BinLayers ping(const Scene& scene) {
  Simulator simulator(scene);
  return simulator.ping_numbered({.position = {0.0, 0.0, -sonar_depth_m}}, 0)[1].bins;
}

/// Intensity times the fourth power of range that the objects add, as a cross-section, m^2.
double added_db(Scene scene) {
  const Sonar& sonar = scene.sonars.front();
  const std::vector<float> with = ping(scene).intensity_mean;
  scene.seafloor.penetration_m = 0.0;
  const std::vector<float> without = ping(scene).intensity_mean;
  double sum = 0.0;
  for (std::size_t i = 0; i < with.size(); ++i) sum += double(with[i]) - double(without[i]);
  return scatter::to_db(std::max(sum, 1e-30) * sonar.bin_m() / sonar.pulse.cell_m(water_mps)) -
         sonar.source_level_db;
}

/// The way to a place d below the bed, h below the sonar and L away, as the quickest one, and what
/// it leaves of 1 m^2's echo: by golden section, difference quotients and complex reflection, none
/// of which the program uses.
struct Way {
  double sin_sediment, gain, spreading_m2;
};
Way way(const scatter::Sediment& s, double wavelength_m, double d, double L) {
  const double h = sand_m - sonar_depth_m, nu = s.sound_speed_ratio;
  const auto time = [&](double x) { return std::hypot(x, h) + std::hypot(L - x, d) / nu; };
  double low = 0.0, high = L;
  for (int i = 0; i < 100; ++i) {
    const double a = low + 0.381966 * (high - low), b = low + 0.618034 * (high - low);
    (time(a) < time(b) ? high : low) = time(a) < time(b) ? b : a;
  }
  const double launch = std::atan2(h, 0.5 * (low + high));
  const auto arrival = [&](double angle) { return std::acos(nu * std::cos(angle)); };
  const auto reached = [&](double angle) {
    return h / std::tan(angle) + d / std::tan(arrival(angle));
  };
  constexpr double step = 1e-5;
  const double q = std::abs(reached(launch + step) - reached(launch - step)) / (2.0 * step);
  const double out_m2 = L * q * std::sin(arrival(launch)) / std::cos(launch);
  // Refraction widens 1 sr of the sediment to sin_s / (sin_w nu^2) sr of the water, since cos_s =
  // nu cos_w.
  const double back_m2 = out_m2 / (nu * nu);
  // Rayleigh's coefficient from the impedances of a lossy fluid.
  const std::complex<double> kappa = std::complex<double>(1.0, s.loss) / nu;
  const std::complex<double> vertical = std::sqrt(kappa * kappa - std::pow(std::cos(launch), 2.0));
  const std::complex<double> y = s.density_ratio * std::sin(launch) / vertical;
  const double through = 1.0 - std::norm((y - 1.0) / (y + 1.0));
  // 54.575 delta dB per wavelength in the sediment, out and back.
  const double lost_db =
      2.0 * 54.575 * s.loss / (nu * wavelength_m) * d / std::sin(arrival(launch));
  return {std::sin(arrival(launch)),
          through * through * scatter::from_db(-lost_db) / (out_m2 * back_m2),
          std::sqrt(out_m2 * back_m2)};
}

constexpr double radius_m = 0.1, mu_db = -10.0;

Material dull() {
  Material made{.name = "dull", .model = "solid", .like = "stone"};
  made.diffuse_db = mu_db;
  made.specular = 0.0;
  return made;
}

/// A ball, or a pipe across the beam, whose middle lies `deep_m` under the bed.
ObjectOptions buried(const char* shape, const char* material, double deep_m) {
  ObjectOptions object{.shape = shape, .material = material};
  object.east_m = target_east_m;
  object.height_m = -deep_m - radius_m;
  object.size.diameter_m = 2.0 * radius_m;
  object.size.facet_m = 0.01;
  return object;
}

}  // namespace

TEST_CASE("a ball in mud has the sonar equation's echo with the losses of bed and mud") {
  struct Case {
    const char* sediment;
    double frequency_hz, deep_m;
  };
  for (const auto& [name, frequency_hz, deep_m] : {Case{"coarse silt", 50e3, 0.15},
                                                   {"coarse silt", 30e3, 0.3},
                                                   {"sandy clay", 50e3, 0.6},
                                                   {"sandy clay", 120e3, 0.3},
                                                   {"fine sand", 20e3, 0.2}}) {
    Scene scene = muddy_scene(name, frequency_hz);
    scene.materials = {dull()};
    scene.objects = {buried("sphere", "dull", deep_m)};
    const scatter::Sediment s = scatter::sediment_named(name);
    const double wavelength_m = water_mps / frequency_hz;
    double expected = 0.0;
    constexpr int steps = 120;
    for (int i = 0; i < steps; ++i)
      for (int j = 0; j < 2 * steps; ++j) {
        const double polar = pi * (i + 0.5) / steps, turn = pi * (j + 0.5) / steps;
        const Eigen::Vector3d normal(std::sin(polar) * std::cos(turn),
                                     std::sin(polar) * std::sin(turn), std::cos(polar));
        const double d = deep_m - radius_m * normal.z();
        const double x = target_east_m + radius_m * normal.x(), y = radius_m * normal.y();
        const Way its = way(s, wavelength_m, d, std::hypot(x, y));
        const double level = std::sqrt(1.0 - its.sin_sediment * its.sin_sediment);
        const Eigen::Vector3d arrival(level * x / std::hypot(x, y), level * y / std::hypot(x, y),
                                      -its.sin_sediment);
        const double facing = std::max(-arrival.dot(normal), 0.0);
        const double area_m2 = radius_m * radius_m * std::sin(polar) * (pi / steps) * (pi / steps);
        // The beam across: sinc^4 of L y / lambda r.
        const double sine = y / std::hypot(x, y, sand_m - sonar_depth_m + d);
        const double phase = pi * 25e3 / frequency_hz * sine / wavelength_m;
        const double sinc = std::abs(phase) < 1e-9 ? 1.0 : std::sin(phase) / phase;
        expected +=
            std::pow(sinc, 4.0) * scatter::from_db(mu_db) * facing * facing * area_m2 * its.gain;
      }
    CAPTURE(name, frequency_hz, deep_m);
    CHECK(added_db(scene) == Approx(scatter::to_db(expected)).margin(0.2));
  }
}

namespace {

/// As way(), where the water's sound speed falls linearly from the sonar's depth to the bed: by the
/// closed form of the range of an arc, and bisection.
double bent_gain(const scatter::Sediment& s, double frequency_hz, double d, double L,
                 double sonar_mps, double bed_mps) {
  const double gradient_per_s = (bed_mps - sonar_mps) / (sand_m - sonar_depth_m);
  const double nu = s.sound_speed_ratio;
  const auto cosines = [&](double launch) {
    const double at_bed = std::cos(launch) * bed_mps / sonar_mps;
    return std::pair(at_bed, nu * at_bed);
  };
  const auto reached = [&](double launch) {
    const auto [in_water, in_sediment] = cosines(launch);
    const double water_m = (std::sin(launch) - std::sqrt(1.0 - in_water * in_water)) * sonar_mps /
                           (std::cos(launch) * gradient_per_s);
    return water_m + d / std::tan(std::acos(in_sediment));
  };
  double low = 0.01, high = 1.5;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (reached(middle) > L ? low : high) = middle;
  }
  const auto [in_water, in_sediment] = cosines(low);
  constexpr double step = 1e-5;
  const double q = std::abs(reached(low + step) - reached(low - step)) / (2.0 * step);
  const double out_m2 = L * q * std::sqrt(1.0 - in_sediment * in_sediment) / std::cos(low);
  const double back_m2 = out_m2 * std::pow(sonar_mps / (nu * bed_mps), 2.0);  // reciprocity
  const std::complex<double> kappa = std::complex<double>(1.0, s.loss) / nu;
  const std::complex<double> vertical = std::sqrt(kappa * kappa - in_water * in_water);
  const std::complex<double> y = s.density_ratio * std::sqrt(1.0 - in_water * in_water) / vertical;
  const double through = 1.0 - std::norm((y - 1.0) / (y + 1.0));
  const double lost_db = 2.0 * 54.575 * s.loss / (nu * bed_mps / frequency_hz) * d /
                         std::sqrt(1.0 - in_sediment * in_sediment);
  return through * through * scatter::from_db(-lost_db) / (out_m2 * back_m2);
}

}  // namespace

TEST_CASE("sound that the water bends enters the bed at the angle at which it arrives there") {
  const TemporaryFolder folder;
  write_text(folder / "falls.csv", "depth_m,soundspeed_mps\n10,1530\n20,1480\n");
  constexpr double frequency_hz = 50e3, deep_m = 0.3;
  for (const auto& [name, far_m] : {std::pair("sandy clay", 35.0), {"fine sand", 16.0}}) {
    Scene scene = muddy_scene(name, frequency_hz);
    scene.seafloor.extent_east_m = 120.0;
    scene.sonars.front().range_m = 50.0;
    scene.sonars.front().bins = 2000;
    scene.materials = {dull()};
    scene.objects = {buried("sphere", "dull", deep_m)};
    scene.objects.front().east_m = far_m;
    scene.sea.sound_speed_mps.reset();
    scene.sea.profile = {"falls.csv", folder / "falls.csv"};
    scene.sea.refraction = RefractionMode::time_only;
    const double straight_db = added_db(scene);
    scene.sea.refraction = RefractionMode::full;
    const double bent_db = added_db(scene);
    const scatter::Sediment s = scatter::sediment_named(name);
    const double law_db = scatter::to_db(bent_gain(s, frequency_hz, deep_m, far_m, 1530.0, 1480.0) /
                                         way(s, 1505.0 / frequency_hz, deep_m, far_m).gain);
    CAPTURE(name, bent_db, straight_db);
    CHECK(law_db > 1.0);
    CHECK(bent_db - straight_db == Approx(law_db).margin(0.3));
  }
}

TEST_CASE("a buried pipe shows at 50 kHz in coarse silt, and vanishes at 400 kHz") {
  const auto bins_of_pipe = [](double frequency_hz, double penetration_m) {
    Scene scene = muddy_scene("coarse silt", frequency_hz);
    scene.seafloor.penetration_m = penetration_m;
    ObjectOptions pipe = buried("cylinder", "fouled steel", radius_m + 0.05);
    pipe.size.length_m = 30.0;
    scene.objects = {pipe};
    const BinLayers bins = ping(scene);
    return std::ranges::count(bins.instance, 1u);
  };
  CHECK(bins_of_pipe(50e3, 1.0) >= 3);
  CHECK(bins_of_pipe(400e3, 1.0) == 0);
  CHECK(bins_of_pipe(50e3, 0.0) == 0);   // off by default
  CHECK(bins_of_pipe(50e3, 0.01) == 0);  // the pipe lies below the layer
  // Where the pipe shows, it is brighter than the bed; the ranges are those of the slower way.
  Scene scene = muddy_scene("coarse silt", 50e3);
  ObjectOptions pipe = buried("cylinder", "fouled steel", radius_m + 0.05);
  pipe.size.length_m = 30.0;
  scene.objects = {pipe};
  const BinLayers with = ping(scene);
  scene.seafloor.penetration_m = 0.0;
  const BinLayers without = ping(scene);
  float most = 0.0f;
  for (std::size_t i = 0; i < with.instance.size(); ++i)
    most = std::max(most, with.intensity_mean[i] / std::max(without.intensity_mean[i], 1e-20f));
  CHECK(scatter::to_db(double(most)) > 3.0);
}

TEST_CASE("a bed that lets no sound in although it should gives a warning") {
  const auto told = [](const char* material) {
    const Simulator simulator(muddy_scene(material, 50e3));
    return std::ranges::count_if(simulator.warnings(), [](const std::string& warning) {
      return warning.starts_with("seafloor.penetration_m: no sound enters");
    });
  };
  CHECK(told("seagrass") == 1);
  CHECK(told("clay") == 0);
}

TEST_CASE("a smooth buried pipe glints as a smooth cylinder, with the losses of bed and mud") {
  // It lies almost straight below, so that its upper side is a mirror for the sonar. A glint is
  // a / (2 lambda) |integral of exp(2 i k z^2 / 2 r) dz|^2 r / (r + a), with the wavelength of mud.
  for (const double length_m : {0.8, 1.9, 12.0})
    for (const double north_m : {0.0, 0.4 * length_m}) {
      Scene scene = muddy_scene("sandy clay", 50e3);
      Material mirror{.name = "mirror", .model = "solid", .like = "steel"};
      mirror.diffuse_db = -80.0;
      mirror.specular = 0.9;
      mirror.lobe_width_rad = 0.0;
      scene.materials = {mirror};
      ObjectOptions pipe = buried("cylinder", "mirror", 0.4);
      pipe.east_m = 0.5;
      pipe.north_m = north_m;
      pipe.size.length_m = length_m;
      scene.objects = {pipe};
      const scatter::Sediment s = scatter::sediment_named("sandy clay");
      const double wavelength_m = water_mps / 50e3;
      const Way its = way(s, wavelength_m, 0.3, 0.5);
      const double r = std::sqrt(its.spreading_m2), in_mud_m = s.sound_speed_ratio * wavelength_m;
      constexpr int steps = 20000;
      const double step_m = length_m / steps;
      std::complex<double> sum = 0.0;
      for (int i = 0; i < steps; ++i) {
        const double z = north_m + (i + 0.5) * step_m - 0.5 * length_m;
        sum += std::polar(step_m, 2.0 * pi / in_mud_m * z * z / r);
      }
      const double cross_section_m2 =
          0.9 * radius_m * std::norm(sum) / (2.0 * in_mud_m) * r / (r + radius_m);
      CAPTURE(length_m, north_m);
      CHECK(added_db(scene) == Approx(scatter::to_db(cross_section_m2 * its.gain)).margin(0.5));
    }
}
