#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "physics/above_bed.h"
#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/engine/scene/scene.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

double uniform(double) { return 1.0; }
double hann(double u) { return 1.0 + std::cos(2.0 * std::numbers::pi * u); }

/// One-way power of an array, summed over elements with their exact distances: no approximation.
/// It is focused at a range, and `weight` shades it.
double one_way_focused(double length_m, double along_m, double abeam_m, double focus_m = 1e9,
                       double (*weight)(double) = uniform) {
  constexpr int elements = 600;
  std::complex<double> sum = 0.0;
  for (int i = 0; i < elements; ++i) {
    const double u = (i + 0.5) / elements - 0.5, x_m = length_m * u;
    const double delay_m = std::hypot(focus_m, x_m) - focus_m;
    sum += std::polar(weight(u) / elements,
                      2.0 * std::numbers::pi / wavelength_m *
                          (std::hypot(along_m - x_m, abeam_m) - abeam_m - delay_m));
  }
  return std::norm(sum);
}

/// Equivalent width of transmit x receive at a range, rad.
double two_way_width_rad(double length_m, double range_m, double focus_m = 1e9,
                         double (*weight)(double) = uniform) {
  const double step = 2e-4 / length_m;
  double sum = 0.0;
  const double end = length_m * std::max(1.0 / range_m, std::abs(1.0 / range_m - 1.0 / focus_m)) +
                     4.0 * wavelength_m / length_m;
  for (double s = 0.5 * step; s < end; s += step)
    sum += 2.0 * step *
           std::pow(one_way_focused(length_m, range_m * s, range_m * std::sqrt(1.0 - s * s),
                                    focus_m, weight),
                    2);
  return sum;
}

/// A small level plate abeam to starboard, 3 m down for every 4 m out.
Seafloor plate(double range_m, double side_m) {
  Seafloor bed = level_bed(0.6 * range_m, 0.5 * side_m);
  for (Eigen::Vector3f& p : bed.mesh.positions) p.x() += static_cast<float>(0.8 * range_m);
  return bed;
}

/// Energy of the plate's echo, with the sonar at a distance along the track.
class PassingPlate {
 public:
  PassingPlate(const Sonar& sonar, double range_m, double side_m)
      : bed_(plate(range_m, side_m)),
        pinger_(sonar, {}, bed_, lambert_),
        tracer_(make_intersector("embree", bed_.mesh)),
        altitude_m_(0.6 * range_m),
        bins_(sonar.bins) {}
  double energy(double along_m) {
    const EchoLine line = echo_line(pinger_, {.sector = 1}, {.position = {0.0, along_m, 0.0}},
                                    altitude_m_, {tracer_.get(), bed_.mesh}, bins_);
    double sum = 0.0;
    for (const float i : line.bins.intensity_mean) sum += i;
    return sum;
  }

 private:
  const std::vector<MaterialInSonar> lambert_ = materials_of(2, scatter::Lambert(-27.0));
  Seafloor bed_;
  PingTracer pinger_;
  std::unique_ptr<Intersector> tracer_;
  double altitude_m_;
  int bins_;
};

/// -3 dB width of an even function, found in steps.
template <class F>
double beam_width_m(F&& level, double step_m) {
  const double half = 0.5 * level(0.0);
  double x = 0.0, before = level(0.0);
  for (;;) {
    const double next = level(x + step_m);
    if (next < half) return 2.0 * (x + step_m * (before - half) / (before - next));
    before = next;
    x += step_m;
  }
}

}  // namespace

TEST_CASE("in the near field a flat bed's level has the width of an unfocused array's beam") {
  for (const double altitude_m : {6.0, 10.0}) {
    Sonar sonar = plain_sonar();
    sonar.focused = false;
    const Medium medium{1500.0, 0.0};
    const auto lines = ping_once(sonar, level_bed(20.0),
                                 {.position = {0.0, 0.0, altitude_m - 20.0}}, altitude_m, medium);
    for (const double heights : {1.2, 1.5, 2.0, 3.0, 5.0, 7.0}) {
      const auto bin = static_cast<std::size_t>(heights * altitude_m / sonar.bin_m());
      // The middle of the cell that a CW pulse's bin receives.
      const double r = lines[1].bins.range_m[bin] - 0.5 * sonar.pulse.cell_m(1500.0);
      const double sine = altitude_m / r;
      const double area_m2 = r * two_way_width_rad(sonar.array_length_m, r) *
                             sonar.pulse.cell_m(1500.0) / std::sqrt(1.0 - sine * sine);
      const double expected_db = sonar.source_level_db - 40.0 * std::log10(r) - 27.0 +
                                 20.0 * std::log10(sine) + 10.0 * std::log10(area_m2);
      CAPTURE(altitude_m, r);
      CHECK(scatter::to_db(lines[1].bins.intensity_mean[bin]) ==
            Approx(expected_db).epsilon(0).margin(0.05));
    }
  }
}

TEST_CASE(
    "a wall nearer than the bed has the width of an unfocused array's beam, at any altitude") {
  Scene scene;
  scene.speckle = scene.texture = false;
  scene.sea.sound_speed_mps = 1500.0;
  scene.sea.absorption_db_per_km = 0.0;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 120.0;
  scene.seafloor.cell_m = 2.0;
  scene.seafloor.depth_m = 60.0;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  ObjectOptions wall{.shape = "box", .material = "lambert wall"};
  wall.east_m = 10.0;
  wall.size = {.length_m = 100.0, .width_m = 10.0, .shape_height_m = 58.0};
  scene.objects = {wall};
  scene.materials = {{.name = "lambert wall", .model = "lambert"}};
  Sonar& sonar = scene.sonars.front() = plain_sonar();
  sonar.range_m = 40.0;
  sonar.bins = 1600;
  for (const double altitude_m : {8.0, 30.0}) {
    const auto level_db = [&](bool focused) {
      scene.sonars.front().focused = focused;
      Simulator simulator(scene);
      std::vector<double> all;
      for (const float intensity :
           simulator.ping({.position = {0.0, 0.0, altitude_m - 60.0}})[1].bins.intensity_mean)
        all.push_back(scatter::to_db(std::max(double(intensity), 1e-30)));
      return all;
    };
    const std::vector<double> unfocused_db = level_db(false), focused_db = level_db(true);
    for (const double range_m : {5.5, 6.0, 7.0}) {
      const auto bin = static_cast<std::size_t>(range_m / sonar.bin_m());
      const double ratio = two_way_width_rad(sonar.array_length_m, range_m) /
                           two_way_width_rad(sonar.array_length_m, range_m, range_m);
      CAPTURE(altitude_m, range_m);
      // The outer planes are coarse: they cost up to 0.17 dB.
      CHECK(unfocused_db[bin] - focused_db[bin] == Approx(scatter::to_db(ratio)).margin(0.2));
    }
  }
}

TEST_CASE("a cliff of the bed that is nearer than the bed below has the width of the beam there") {
  // 58 m high, 5 m abeam of the sonar.
  const auto prepared = std::make_shared<PreparedSeafloor>();
  Seafloor& bed = prepared->seafloor;
  for (const float y : {-60.0f, 60.0f})
    for (const auto& [x, z] :
         {std::pair{-60.0f, -60.0f}, {5.0f, -60.0f}, {5.0f, -2.0f}, {60.0f, -2.0f}})
      bed.mesh.positions.emplace_back(x, y, z);
  for (const std::uint32_t i : {0u, 1u, 2u}) {
    bed.mesh.faces.push_back({i, i + 1, i + 5});
    bed.mesh.faces.push_back({i, i + 5, i + 4});
  }
  bed.bed_faces = bed.faces = bed.mesh.faces.size();
  bed.labels = {{1, 1, 0}};
  bed.materials = {"none", "lambert wall"};
  bed.classes = {"none", "seabed"};
  bed.mean_bed_m = -60.0;
  prepared->origin.surface = "static";
  Scene scene;
  scene.speckle = scene.texture = false;
  scene.sea.sound_speed_mps = 1500.0;
  scene.sea.absorption_db_per_km = 0.0;
  scene.materials = {{.name = "lambert wall", .model = "lambert"}};
  Sonar& sonar = scene.sonars.front() = plain_sonar();
  sonar.range_m = 40.0;
  sonar.bins = 1600;
  std::array<std::vector<float>, 2> intensities;
  for (const bool focused : {false, true}) {
    sonar.focused = focused;
    Simulator simulator(scene, {.seafloor = prepared});
    intensities[focused] = simulator.ping({.position = {0.0, 0.0, -30.0}})[1].bins.intensity_mean;
  }
  for (const double range_m : {5.5, 6.0, 7.0}) {
    const auto bin = static_cast<std::size_t>(range_m / sonar.bin_m());
    const double ratio = two_way_width_rad(sonar.array_length_m, range_m) /
                         two_way_width_rad(sonar.array_length_m, range_m, range_m);
    CAPTURE(range_m);
    CHECK(scatter::to_db(intensities[0][bin] / intensities[1][bin]) ==
          Approx(scatter::to_db(ratio)).margin(0.2));
  }
}

TEST_CASE("focused in zones, a flat bed's level has the width of the beam that is out of focus") {
  const double altitude_m = 6.0;
  struct Place {
    double range_m, zone_m;
  };
  for (const ShadingKind shading : {ShadingKind::uniform, ShadingKind::hann}) {
    Sonar sonar = plain_sonar();
    sonar.focused = false;
    sonar.shading = shading;
    sonar.side_lobes = 1;
    sonar.focus_zones_m = {10.0, 30.0};
    const auto lines =
        ping_once(sonar, level_bed(20.0), {.position = {0.0, 0.0, altitude_m - 20.0}}, altitude_m,
                  {1500.0, 0.0});
    for (const Place& place : {Place{7.5, 10.0}, Place{10.0, 10.0}, Place{14.0, 10.0},
                               Place{16.0, 30.0}, Place{30.0, 30.0}, Place{60.0, 30.0}}) {
      const auto bin = static_cast<std::size_t>(place.range_m / sonar.bin_m());
      const double r = lines[1].bins.range_m[bin], sine = altitude_m / r;
      const double width_rad = two_way_width_rad(sonar.array_length_m, r, place.zone_m,
                                                 shading == ShadingKind::hann ? hann : uniform);
      const double area_m2 =
          r * width_rad * sonar.pulse.cell_m(1500.0) / std::sqrt(1.0 - sine * sine);
      const double expected_db = sonar.source_level_db - 40.0 * std::log10(r) - 27.0 +
                                 20.0 * std::log10(sine) + 10.0 * std::log10(area_m2);
      CAPTURE(static_cast<int>(shading), r);
      CHECK(scatter::to_db(lines[1].bins.intensity_mean[bin]) ==
            Approx(expected_db).epsilon(0).margin(0.06));
    }
  }
}

TEST_CASE("a small target has the width of the beam at its range along the track, near and far") {
  for (const bool focused : {false, true})
    for (const double range_m : {6.0, 15.0, 40.0, 120.0}) {
      Sonar sonar = plain_sonar();
      sonar.focused = focused;
      sonar.range_m = 1.2 * range_m;
      sonar.bins = 60;
      sonar.sector_low_rad = 0.62;
      sonar.sector_high_rad = 0.667;
      sonar.planes = 4096;
      sonar.elevations = 128;
      const double length_m = sonar.array_length_m;
      const double roughly_m =
          focused ? 0.64 * wavelength_m * range_m / length_m
                  : std::max(0.5 * length_m, 0.64 * wavelength_m * range_m / length_m);
      const double step_m = roughly_m / 20.0, side_m = roughly_m / 3.0;
      PassingPlate passing(sonar, range_m, side_m);
      const double expected_m = beam_width_m(
          [&](double along_m) {  // the pattern averaged over the plate's length
            double sum = 0.0;
            for (int i = 0; i < 20; ++i) {
              const double x_m = along_m + side_m * ((i + 0.5) / 20.0 - 0.5);
              sum += focused ? std::pow(LineArray{length_m, wavelength_m}.power(x_m / range_m), 2)
                             : std::pow(one_way_focused(length_m, x_m, range_m), 2);
            }
            return sum;
          },
          step_m);
      const double seen_m =
          beam_width_m([&](double along_m) { return passing.energy(along_m); }, step_m);
      CAPTURE(focused, range_m, expected_m, seen_m);
      CHECK(seen_m == Approx(expected_m).epsilon(0.01));
      if (!focused && range_m < 20.0) {
        CHECK(seen_m > 0.4 * length_m);
        CHECK(seen_m < 1.1 * length_m);
      }
    }
}

TEST_CASE("a sonar that moves or turns receives less: the overlap of its two beams") {
  Sonar uniform = plain_sonar(), shaded = uniform, shaded_transmitter = uniform;
  shaded.shading = ShadingKind::hann;
  shaded_transmitter.shading = ShadingKind::hann;  // so its lobe is twice as wide
  shaded_transmitter.receive_shading = ShadingKind::uniform;
  const double altitude_m = 10.0;
  for (const Sonar& sonar : {uniform, shaded, shaded_transmitter}) {
    Pose pose{.position = {0.0, 0.0, -10.0}};
    const auto fixed = ping_once(sonar, level_bed(20.0), pose, altitude_m);
    const LineArray transmitter = sonar.transmit_array(wavelength_m),
                    receiver = sonar.receive_array(wavelength_m);
    const auto overlap = [&](double turned_rad) {
      double sum = 0.0;  // with the side lobes, where the beam turned by more than half its width
      for (double s = -0.15 + 5e-6; s < 0.15; s += 1e-5)
        sum += transmitter.power(s, 50.0, 0.0) * receiver.power(s + turned_rad, 50.0, 0.0);
      return sum;
    };
    const double at_rest = overlap(0.0);
    const auto compare = [&](double turned_rad, double at_range_m) {
      const auto moving = ping_once(sonar, level_bed(20.0), pose, altitude_m);
      const auto bin = static_cast<std::size_t>(at_range_m / sonar.bin_m());
      for (const std::size_t side : {std::size_t{0}, std::size_t{1}})
        CHECK(scatter::to_db(moving[side].bins.intensity_mean[bin] /
                             fixed[side].bins.intensity_mean[bin]) ==
              Approx(scatter::to_db(overlap(turned_rad) / at_rest)).margin(0.03));
    };
    for (const double speed_mps : {2.0, 4.0, 5.5, 7.0}) {
      pose.velocity_mps = {0.0, speed_mps, 0.0};
      for (const double r : {12.0, 30.0, 70.0}) compare(2.0 * speed_mps / 1500.0, r);
    }
    pose.velocity_mps = {0.0, 0.0, 0.0};
    // A change of heading turns the array by 2 r / c times its rate, across the ground range.
    for (const double rate_radps : {0.05, 0.09}) {
      pose.heading_rate_radps = rate_radps;
      for (const double r : {20.0, 70.0})
        compare(rate_radps * 2.0 * std::sqrt(r * r - 100.0) / 1500.0, r);
    }
  }
}
