#include <cmath>
#include <complex>
#include <numbers>

#include "support/beds.h"
#include "support/catch.h"

#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

constexpr double wavelength_m = 0.00375;

/// One-way power of an array, summed over elements with their exact distances: no approximation.
double one_way(double length_m, double along_m, double abeam_m) {
  constexpr int elements = 600;
  std::complex<double> sum = 0.0;
  for (int i = 0; i < elements; ++i) {
    const double x_m = length_m * ((i + 0.5) / elements - 0.5);
    sum += std::polar(1.0 / elements, 2.0 * std::numbers::pi / wavelength_m *
                                          (std::hypot(along_m - x_m, abeam_m) - abeam_m));
  }
  return std::norm(sum);
}

/// Equivalent width of transmit x receive at a range, rad.
double two_way_width_rad(double length_m, double range_m) {
  const double step = 2e-4 / length_m;
  double sum = 0.0;
  for (double s = 0.5 * step; s < length_m / range_m + 2.0 * wavelength_m / length_m; s += step)
    sum +=
        2.0 * step * std::pow(one_way(length_m, range_m * s, range_m * std::sqrt(1.0 - s * s)), 2);
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
        altitude_m_(0.6 * range_m) {
    line_.bins.assign(static_cast<std::size_t>(sonar.bins));
  }
  double energy(double along_m) {
    pinger_.aim({.position = {0.0, along_m, 0.0}}, altitude_m_);
    pinger_.trace(*tracer_, bed_.mesh, 0, Side::starboard);
    pinger_.echo(bed_.mesh, Side::starboard, line_);
    double sum = 0.0;
    for (const float i : line_.bins.intensity_mean) sum += i;
    return sum;
  }

 private:
  const std::vector<scatter::BackscatterTable> lambert_{
      2, scatter::BackscatterTable(scatter::Lambert(-27.0))};
  Seafloor bed_;
  PingTracer pinger_;
  std::unique_ptr<Intersector> tracer_;
  double altitude_m_;
  EchoLine line_;
};

/// -3 dB width of an even function, found in steps.
template <class F>
double width_m(F&& level, double step_m) {
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
      // A tone's range cell lies behind its leading edge.
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
      const double expected_m = width_m(
          [&](double along_m) {  // the pattern averaged over the plate's length
            double sum = 0.0;
            for (int i = 0; i < 20; ++i) {
              const double x_m = along_m + side_m * ((i + 0.5) / 20.0 - 0.5);
              sum += focused ? std::pow(LineArray{length_m, wavelength_m}.power(x_m / range_m), 2)
                             : std::pow(one_way(length_m, x_m, range_m), 2);
            }
            return sum;
          },
          step_m);
      const double seen_m =
          width_m([&](double along_m) { return passing.energy(along_m); }, step_m);
      CAPTURE(focused, range_m, expected_m, seen_m);
      CHECK(seen_m == Approx(expected_m).epsilon(0.01));
      if (!focused && range_m < 20.0) {
        CHECK(seen_m > 0.4 * length_m);
        CHECK(seen_m < 1.1 * length_m);
      }
    }
}

TEST_CASE("a sonar that moves or turns receives less: the overlap of its two beams") {
  const Sonar sonar = plain_sonar();
  const double altitude_m = 10.0;
  Pose pose{.position = {0.0, 0.0, -10.0}};
  const auto fixed = ping_once(sonar, level_bed(20.0), pose, altitude_m);
  const auto overlap = [&](double turned_rad) {
    const auto beam = [&](double s) {
      const double a = std::numbers::pi * sonar.array_length_m * s / wavelength_m;
      return std::abs(a) < 1e-6 ? 1.0 : std::pow(std::sin(a) / a, 2);
    };
    double sum = 0.0;
    for (double s = -0.0075 + 5e-6; s < 0.0075; s += 1e-5) sum += beam(s) * beam(s + turned_rad);
    return sum;
  };
  const auto compare = [&](double lost_db, double at_range_m) {
    const auto moving = ping_once(sonar, level_bed(20.0), pose, altitude_m);
    const auto bin = static_cast<std::size_t>(at_range_m / sonar.bin_m());
    for (const std::size_t side : {std::size_t{0}, std::size_t{1}})
      CHECK(scatter::to_db(moving[side].bins.intensity_mean[bin] /
                           fixed[side].bins.intensity_mean[bin]) == Approx(lost_db).margin(0.03));
  };
  pose.velocity_mps = {0.0, 2.0, 0.0};
  for (const double r : {12.0, 30.0, 70.0})
    compare(scatter::to_db(overlap(2.0 * 2.0 / 1500.0) / overlap(0.0)), r);
  pose.velocity_mps = {0.0, 0.0, 0.0};
  pose.heading_rate_radps = 0.05;  // turns the array by 2 r / c times that across the ground range
  for (const double r : {20.0, 70.0})
    compare(scatter::to_db(overlap(0.05 * 2.0 * std::sqrt(r * r - 100.0) / 1500.0) / overlap(0.0)),
            r);
}
