#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/sonar/echo/beam.h>
#include <ensonify/engine/sonar/instrument/beam_pattern.h>
#include <ensonify/engine/sonar/instrument/sonar.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify::engine;
using ensonify::scatter::to_db;

namespace {

double power(const Shading& shading, double x) {
  return shading.far_field(x) * shading.far_field(x);
}

/// The highest levels between neighbouring nulls, side lobe 1 first, dB.
std::vector<double> side_lobes_db(const Shading& shading, int count) {
  std::vector<double> levels;
  for (int lobe = 1; lobe <= count; ++lobe) {
    double highest = 0.0;
    for (double x = shading.null_x(lobe); x < shading.null_x(lobe + 1); x += 1e-3)
      highest = std::max(highest, power(shading, x));
    levels.push_back(to_db(highest));
  }
  return levels;
}

/// The power of an array of point elements with its weights, focused at a range: the sum over the
/// elements with exact distances, at a distance y_m along the array.
double summed_power(const LineArray& array, double y_m, double range_m, double focus_m) {
  constexpr int elements = 4096;
  std::complex<double> sum = 0.0;
  double weights = 0.0;
  for (int i = 0; i < elements; ++i) {
    const double u = (i + 0.5) / elements - 0.5, a_m = u * array.length_m;
    const double way_m = std::hypot(range_m, y_m - a_m) - std::hypot(range_m, y_m);
    const double delay_m = std::hypot(focus_m, a_m) - focus_m;
    sum += std::polar(array.shading.at(u),
                      2.0 * std::numbers::pi / array.wavelength_m * (way_m - delay_m));
    weights += array.shading.at(u);
  }
  return std::norm(sum / weights);
}

const std::array<std::pair<std::string, Shading>, 5> all_shadings{
    {{"uniform", Shading{}},
     {"hann", Shading::hann()},
     {"taylor", Shading::taylor(-30.0, 4)},
     {"chebyshev", Shading::chebyshev(-40.0)},
     {"weights", Shading::of_weights(std::vector{1.0, 2.0, 4.0, 2.0, 1.0})}}};

}  // namespace

// Harris, Proc. IEEE 66, 51 (1978), table 1: highest side lobe, equivalent noise bandwidth, -3 dB
// bandwidth; one way, in units of lambda / L.
TEST_CASE("windows have the published side lobes, noise width and beam width") {
  struct Published {
    Shading shading;
    double side_lobe_db, noise_width, beam_width;
  };
  std::vector<double> hamming, triangle;
  for (int i = 0; i < 200; ++i) {
    const double u = (i + 0.5) / 200.0 - 0.5;
    hamming.push_back(0.54 + 0.46 * std::cos(2.0 * std::numbers::pi * u));
    triangle.push_back(1.0 - 2.0 * std::abs(u));
  }
  for (const Published& published :
       {Published{Shading{}, -13.0, 1.00, 0.89}, Published{Shading::hann(), -32.0, 1.50, 1.44},
        Published{Shading::of_weights(hamming), -43.0, 1.36, 1.30},
        Published{Shading::of_weights(triangle), -27.0, 1.33, 1.28},
        Published{Shading::chebyshev(-50.0), -50.0, 1.39, 1.33},
        Published{Shading::chebyshev(-60.0), -60.0, 1.51, 1.44},
        Published{Shading::chebyshev(-70.0), -70.0, 1.62, 1.55}}) {
    CAPTURE(published.side_lobe_db);
    const std::vector<double> levels = side_lobes_db(published.shading, 20);
    CHECK(*std::ranges::max_element(levels) == Approx(published.side_lobe_db).margin(0.6));
    // He divides by the distance of the outer elements' middles: 1 / 128 less than the length.
    CHECK(published.shading.noise_width_x() == Approx(published.noise_width).epsilon(0.016));
    CHECK(published.shading.beam_width_x() == Approx(published.beam_width).epsilon(0.016));
  }
  CHECK(side_lobes_db(Shading::hann(), 1)[0] == Approx(-31.47).margin(0.01));
}

TEST_CASE("Chebyshev's side lobes are all at their level, lower only by the elements' own beam") {
  for (const double level_db : {-20.0, -30.0, -45.0, -60.0}) {
    const std::vector<double> levels = side_lobes_db(Shading::chebyshev(level_db), 20);
    for (std::size_t i = 0; i < levels.size(); ++i) {
      CAPTURE(level_db, i);
      CHECK(levels[i] == Approx(level_db).margin(i < 9 ? 0.1 : 0.4));
      CHECK(levels[i] < level_db + 1e-6);
    }
  }
}

// Taylor (1955): nulls at sigma sqrt(A^2 + (n - 1/2)^2) below nbar and at n from there on.
TEST_CASE("Taylor's nulls lie where he put them, and his near side lobes are at their level") {
  CHECK(Shading::min_nbar(-25.0) == 3);  // his own advice
  CHECK(Shading::min_nbar(-40.0) == 6);
  for (const auto& [level_db, nbar] :
       {std::pair{-20.0, 2}, {-25.0, 3}, {-30.0, 4}, {-30.0, 8}, {-40.0, 6}, {-60.0, 12}}) {
    const Shading shading = Shading::taylor(level_db, nbar);
    const double a = std::acosh(std::pow(10.0, -level_db / 20.0)) / std::numbers::pi;
    const double sigma = nbar / std::hypot(a, nbar - 0.5);
    for (int n = 1; n < nbar + 4; ++n) {
      CAPTURE(level_db, nbar, n);
      CHECK(shading.null_x(n) ==
            Approx(n < nbar ? sigma * std::hypot(a, n - 0.5) : n).margin(1e-6));
    }
    const std::vector<double> levels = side_lobes_db(shading, 12);
    CHECK(*std::ranges::max_element(levels) == levels.front());
    CHECK(levels.front() <= level_db + 0.05);
    CHECK(levels.front() > level_db - 0.75);
    for (std::size_t i = 1; i < levels.size(); ++i) CHECK(levels[i] < levels[i - 1]);
  }
  CHECK(Shading::taylor(-30.0, 20).null_x(1) ==
        Approx(Shading::chebyshev(-30.0).null_x(1)).epsilon(0.03));
}

TEST_CASE("the noise width is the integral of the beam, and the weights are 1 in the mean") {
  for (const auto& [name, shading] : all_shadings) {
    CAPTURE(name);
    double integral = 0.0, mean = 0.0, square = 0.0;
    for (double x = 0.01; x < 4000.0; x += 0.02) integral += 0.04 * power(shading, x);
    for (int i = 0; i < 64000; ++i) {
      const double w = shading.at((i + 0.5) / 64000 - 0.5);
      mean += w / 64000;
      square += w * w / 64000;
    }
    CHECK(to_db(integral / shading.noise_width_x()) == Approx(0.0).margin(0.02));
    CHECK(mean == Approx(1.0).epsilon(1e-6));
    CHECK(square == Approx(shading.noise_width_x()).epsilon(1e-6));
    CHECK(shading.far_field(0.0) == Approx(1.0));
    CHECK(shading.field(0.0, 1e-2).real() == Approx(1.0).margin(1e-3));
  }
}

TEST_CASE("near and far, the beam of each shading is the sum over its elements") {
  for (const auto& [name, shading] : all_shadings) {
    const LineArray array{.length_m = 0.5, .wavelength_m = 0.00375, .shading = shading};
    for (const double range_m : {6.0, 10.0, 40.0, 200.0}) {
      const double scale = power(shading, 0.0) / (1.0 + 2.0 * array.nearness(range_m, 1.0));
      const ArrayTable table(2, shading);
      const ArrayTable::Row row = table.row(array.nearness(range_m, 1.0));
      for (double y_m = 0.0; y_m < 0.25 + 2.0 * 0.0075 * range_m; y_m += 0.0411) {
        CAPTURE(name, range_m, y_m);
        const double sin_psi = y_m / std::hypot(range_m, y_m);
        const double summed = summed_power(array, y_m, range_m, 1e9);
        CHECK(array.power(sin_psi, range_m) == Approx(summed).margin(0.005 * scale));
        const double x = sin_psi * array.length_m / array.wavelength_m;
        if (x < array.nearness(range_m, 1.0) + table.reach() - 0.1)
          CHECK(row.scale * table.value(row, static_cast<float>(x)) ==
                Approx(summed).margin(0.01 * scale));
      }
    }
  }
}

TEST_CASE("focused in zones: the far field at a zone's range, elsewhere the defocused sum") {
  Sonar sonar;
  sonar.focus_zones_m = {10.0, 20.0, 50.0};
  sonar.shading = ShadingKind::taylor;
  sonar.shading_side_lobe_db = -25.0;
  sonar.range_m = 120.0;
  sonar.planes = 64;
  sonar.vertical.beamwidth_rad = 0.0;
  const double wavelength_m = 0.00375;
  const LineArray array = sonar.transmit_array(wavelength_m);
  const Beam beam(sonar, wavelength_m);
  const ReceiverMotion fixed = receiver_motion({}, port_sector, 80.0, 1500.0);
  for (const auto& [range_m, zone_m] : {std::pair{6.0, 10.0},
                                        {10.0, 10.0},
                                        {13.0, 10.0},
                                        {13.6, 20.0},
                                        {20.0, 20.0},
                                        {28.0, 20.0},
                                        {29.0, 50.0},
                                        {50.0, 50.0},
                                        {110.0, 50.0}}) {
    CHECK(sonar.defocus(range_m) == Approx(1.0 - range_m / zone_m));
    const double scale =
        1.0 / (1.0 + 2.0 * std::abs(array.nearness(range_m, sonar.defocus(range_m))));
    for (double sin_psi = 0.0; sin_psi < 0.012; sin_psi += 0.0007) {
      CAPTURE(range_m, sin_psi);
      const double y_m = range_m * sin_psi / std::sqrt(1.0 - sin_psi * sin_psi);
      const double summed = summed_power(array, y_m, range_m, zone_m);
      CHECK(array.power(sin_psi, range_m, sonar.defocus(range_m)) ==
            Approx(summed).margin(0.005 * scale));
      if (range_m == zone_m)
        CHECK(array.power(sin_psi, range_m, 0.0) == Approx(array.power(sin_psi)));
      if (sin_psi > 0.9 * array.null_rad(1)) continue;  // beyond the table at a zone's range
      const std::array<BeamSample, 1> sample{{{static_cast<float>(sin_psi), 1.0f}}};
      CHECK(beam.two_way(0, sample, 1.0, fixed.abeam, range_m, fixed) ==
            Approx(summed * summed).epsilon(0.005).margin(0.01 * scale * scale));
    }
  }
  sonar.focus_zones_m.clear();
  CHECK(sonar.defocus(30.0) == 1.0);
  sonar.focused = true;
  CHECK(sonar.defocus(30.0) == 0.0);
}

TEST_CASE("the fan of a sonar focused in zones reaches as far as its widest beam") {
  Sonar sonar;
  sonar.range_m = 120.0;
  sonar.focus_zones_m = {10.0, 80.0};
  for (const double nearest_m : {4.0, 9.0, 15.0}) {
    const double worst_m = sonar.most_defocused_m(nearest_m);
    double largest = 0.0;
    for (double r = nearest_m; r <= 120.0; r += 0.01)
      largest = std::max(largest, std::abs(sonar.defocus(r)) / r);
    CAPTURE(nearest_m, worst_m);
    CHECK(std::abs(sonar.defocus(worst_m)) / worst_m == Approx(largest).epsilon(1e-3));
  }
}

TEST_CASE("weights may have any scale, and faulty shadings are refused with the reason") {
  const Shading a = Shading::of_weights(std::vector{1.0, 3.0, 1.0});
  const Shading b = Shading::of_weights(std::vector{10.0, 30.0, 10.0});
  for (double x = 0.0; x < 4.0; x += 0.1) CHECK(a.far_field(x) == Approx(b.far_field(x)));
  CHECK(Shading::of_weights(std::vector{2.0, 2.0, 2.0}).uniform());
  using Catch::Contains;
  CHECK_THROWS_WITH(Shading::of_weights({}), Contains("no weights"));
  CHECK_THROWS_WITH(Shading::of_weights(std::vector{0.0, 0.0}), Contains("sum"));
  CHECK_THROWS_WITH(Shading::of_weights(std::vector{1.0, 2.0, 3.0}), Contains("weight 1 is 1"));
  CHECK_THROWS_WITH(Shading::taylor(-40.0, 5), Contains("nbar of 6 or more"));
}
