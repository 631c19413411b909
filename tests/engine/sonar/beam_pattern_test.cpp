#include <cmath>
#include <numbers>

#include "support/catch.h"

#include <ensonify/engine/sonar/aperture.h>
#include <ensonify/engine/sonar/beam_pattern.h>
#include <ensonify/engine/sonar/pulse.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify::engine;
using ensonify::scatter::to_db;

namespace {
constexpr LineArray array{.length_m = 0.5, .wavelength_m = 0.00375};
}

TEST_CASE("a line array's one-way beam is 0.8859 lambda/L wide, its two-way beam 0.6378") {
  const double unit = array.wavelength_m / array.length_m;
  CHECK(to_db(array.power(0.5 * 0.8859 * unit)) == Approx(-3.0103).margin(0.002));
  CHECK(2.0 * to_db(array.power(0.5 * 0.6378 * unit)) == Approx(-3.0103).margin(0.002));
}

TEST_CASE("a line array's first null is at lambda/L and its first side lobe at -13.26 dB") {
  CHECK(array.power(std::sin(array.first_null_rad())) < 1e-20);
  double highest = 0.0;
  for (double x = 1.05; x < 1.95; x += 1e-3)
    highest = std::max(highest, array.power(x * array.wavelength_m / array.length_m));
  CHECK(to_db(highest) == Approx(-13.26).margin(0.01));
}

TEST_CASE("the two-way beam's integral is its equivalent width, 2/3 lambda/L") {
  double integral = 0.0;
  const double step = 1e-6;
  for (double psi = 0.5 * step; psi < 40.0 * array.first_null_rad(); psi += step)
    integral += 2.0 * std::pow(array.power(std::sin(psi)), 2) * step;
  CHECK(integral == Approx(array.two_way_width_rad()).epsilon(1e-3));
}

TEST_CASE("an aperture's weights sum over planes to the beam's width at every elevation") {
  Sonar sonar;
  sonar.vertical.beamwidth_rad = 0.0;
  const Aperture aperture = make_aperture(sonar, 0.00375, 7.5);
  const std::size_t elevations = aperture.grid->elevation_rad.size();
  const LineArray its_array{sonar.array_length_m, 0.00375};
  for (std::size_t j = 0; j < elevations; ++j) {
    double sum = 0.0;
    for (std::size_t k = 0; k < aperture.grid->planes.size(); ++k)
      sum += aperture.weight[k * elevations + j];
    // 0.01 dB lie beyond the first null, where the fan ends.
    REQUIRE(std::abs(to_db(sum / its_array.two_way_width_rad())) < 0.025);
  }
}

TEST_CASE(
    "the vertical pattern peaks at its tilt, is 3 dB down at half its width, and has a floor") {
  const VerticalPattern pattern;
  CHECK(pattern.power(pattern.tilt_rad) == Approx(1.0));
  for (const double sign : {-1.0, 1.0})
    CHECK(to_db(pattern.power(pattern.tilt_rad + sign * 0.5 * pattern.beamwidth_rad)) ==
          Approx(-3.0103).margin(0.01));
  CHECK(to_db(pattern.power(pattern.tilt_rad + std::numbers::pi)) == Approx(pattern.floor_db));
  for (double d = -3.0; d < 3.0; d += 0.01)
    CHECK(to_db(pattern.power(d)) >= pattern.floor_db - 1e-9);
}

TEST_CASE("a pulse's kernel sums to its range cell over the bin, long or short") {
  for (const double cell_m : {0.001, 0.025, 0.05, 0.0731, 1.0})
    for (const double bin_m : {0.01, 0.05, 0.5}) {
      const std::vector<double> kernel = pulse_kernel(cell_m, bin_m);
      double sum = kernel[0];
      for (std::size_t d = 1; d < kernel.size(); ++d) {
        sum += 2.0 * kernel[d];
        CHECK(kernel[d] >= 0.0);
      }
      CHECK(sum == Approx(cell_m / bin_m));
    }
}
