#include <ensonify/engine/seafloor/bed/spectral.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/bed/relief_fields.h>

#include "engine/seafloor/spectrum.h"
#include "support/catch.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

using std::numbers::pi;

double mean_square(const Heightfield& field) {
  double sum = 0.0;
  for (const double z : field.z_m) sum += z * z;
  return sum / static_cast<double>(field.z_m.size());
}

/// Mean product of the heights of the first and of the last column, or row.
double over_opposite_edges(const Heightfield& field, bool east) {
  const int last_column = field.columns - 1, last_row = field.rows - 1;
  const int count = east ? field.rows : field.columns;
  double sum = 0.0;
  for (int i = 0; i < count; ++i)
    sum +=
        east ? field.at(0, i) * field.at(last_column, i) : field.at(i, 0) * field.at(i, last_row);
  return sum / count;
}

}  // namespace

TEST_CASE("Waves of any length keep their variance when long ones are made on coarser lattices") {
  // A ring of wavenumbers with a variance of 1 m2, from waves of one lattice over those of two to
  // those of the next.
  const double points = GENERATE(5.0, 14.0, 22.0, 28.0, 36.0, 60.0);
  const double east_m = 0.5, north_m = GENERATE(0.5, 0.4);
  CAPTURE(points, north_m);
  const double k0 = 2.0 * pi / (points * east_m), width = 0.1 * k0;
  const double area = 2.0 * pi * k0 * std::sqrt(2.0 * pi) * width;
  SpectralField ring;
  ring.amplitude = [=](double kx, double ky) {
    const double t = (std::hypot(kx, ky) - k0) / width;
    return std::exp(-0.25 * t * t) / std::sqrt(area);
  };
  const Heightfield grid = flat(420, 360, east_m, north_m);
  ring.period_m = 4.0 * 420 * east_m;
  REQUIRE(spectral_field_bytes(grid, ring) < 0.5 * sizeof(double) * 1680.0 * 1680.0);

  double variance_m2 = 0.0, over_edges_m2 = 0.0;
  // A standard error of less than 4 %.
  const int seeds = std::max(4, static_cast<int>(0.02 * points * points));
  for (int seed = 0; seed < seeds; ++seed) {
    Heightfield field = grid;
    add_spectral_field(field, ring, RandomStream(static_cast<std::uint64_t>(seed), Purpose::test));
    variance_m2 += mean_square(field) / seeds;
    over_edges_m2 +=
        0.5 * (over_opposite_edges(field, true) + over_opposite_edges(field, false)) / seeds;
  }
  CHECK(variance_m2 == Approx(1.0).epsilon(0.12));
  CHECK(std::abs(over_edges_m2) < 0.15);
}

TEST_CASE("A field of short reach does not repeat on its heightfield, and needs less memory") {
  const Heightfield grid = flat(400, 300, 0.1, 0.1);
  const FractalRelief relief{.height_at_1m_m = 0.1, .hurst = 0.4, .longest_m = 4.0};
  const SpectralField what = fractal_field(grid, relief);
  SpectralField without_reach = what;
  without_reach.reach_m = 0.0;
  CHECK(spectral_field_bytes(grid, what) < 0.7 * spectral_field_bytes(grid, without_reach));
  double variance_m2 = 0.0, over_edges_m2 = 0.0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Heightfield field = grid;
    add_spectral_field(field, what, RandomStream(seed, Purpose::test));
    variance_m2 += mean_square(field) / 20.0;
    over_edges_m2 +=
        0.5 * (over_opposite_edges(field, true) + over_opposite_edges(field, false)) / 20.0;
  }
  CHECK(std::abs(over_edges_m2) < 0.1 * variance_m2);
  // Von Karman's form: the integral of C (k^2 + k0^2)^-(H+1), with the factor C of fractal.cpp.
  const double h = relief.hurst, k0 = 2.0 * pi / relief.longest_m;
  const double c =
      0.01 * std::pow(2.0, 2.0 * h - 1.0) * h * std::tgamma(1.0 + h) / (pi * std::tgamma(1.0 - h));
  const double all_m2 = c * pi / h * std::pow(k0, -2.0 * h);
  // Waves shorter than two cells are missing.
  const double missing_m2 = c * pi / h * std::pow(pi / 0.1, -2.0 * h);
  CHECK(variance_m2 > 0.95 * (all_m2 - missing_m2));
  CHECK(variance_m2 < 1.05 * all_m2);
}
