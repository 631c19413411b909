#include <cmath>
#include <numbers>

#include "support/catch.h"

#include <ensonify/engine/sonar/reception/moved_beam.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;

TEST_CASE("what is left of a moved beam is 1 at rest, and its table has the sums") {
  constexpr double wavelength_m = 1500.0 / 400e3;
  Sonar focused, near_field, narrow, shaded;
  focused.focused = true;
  narrow.receive_array_length_m = 0.9;
  shaded.shading = ShadingKind::hann;
  for (const Sonar& sonar : {focused, near_field, narrow, shaded}) {
    const MovedBeam beam(sonar, wavelength_m);
    const double null = wavelength_m / sonar.array_length_m;
    for (double range_m = 1.0; range_m < 4.0 * sonar.range_m; range_m *= 1.3) {
      CHECK(beam.share(range_m, 0.0) == Approx(1.0));
      for (double shift = 0.05 * null; shift < 2.0 * null; shift += 0.11 * null) {
        const double summed = beam.summed_share(range_m, shift);
        if (summed < 0.1) break;
        CAPTURE(sonar.focused, sonar.receive_length_m(), range_m, shift);
        CHECK(scatter::to_db(beam.share(range_m, shift) / summed) == Approx(0.0).margin(0.15));
        CHECK(beam.share(range_m, -shift) == beam.share(range_m, shift));
      }
    }
  }
}

TEST_CASE("two moved uniform beams overlap as sinc^2 times sinc^2 does") {
  Sonar sonar;
  sonar.focused = true;
  const double null = 1500.0 / 400e3 / sonar.array_length_m;
  const MovedBeam beam(sonar, 1500.0 / 400e3);
  const auto power = [](double x) {
    const double a = std::numbers::pi * x;
    return std::abs(a) < 1e-6 ? 1.0 : std::pow(std::sin(a) / a, 2);
  };
  for (const double shift : {0.2, 0.5, 0.8, 1.0, 1.2}) {
    double moved = 0.0, at_rest = 0.0;
    for (double x = -29.9995; x < 30.0; x += 0.001) {
      moved += power(x) * power(x + shift);
      at_rest += power(x) * power(x);
    }
    CHECK(beam.summed_share(50.0, shift * null) == Approx(moved / at_rest).epsilon(0.01));
  }
}
