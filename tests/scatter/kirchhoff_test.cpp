#include <cmath>
#include <numbers>

#include "support/catch.h"

#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/kirchhoff.h>
#include <ensonify/scatter/reflection.h>
#include <ensonify/scatter/small_slope.h>

using namespace ensonify::scatter;
using std::numbers::pi;

TEST_CASE("at vertical the formula is the Kirchhoff integral, for any exponent") {
  for (const double exponent : {2.2, 2.4, 2.8, 3.0, 3.25, 3.5, 3.9, 3.98})
    for (const double frequency_hz : {10e3, 30e3, 400e3}) {
      Sediment s = sediment_named("fine sand");
      s.exponent = exponent;
      CAPTURE(exponent, frequency_hz);
      const double k = wavenumber_per_cm(frequency_hz, 1500.0), a = exponent / 2.0 - 1.0;
      const double Ch2 = kirchhoff_shape(s, k).Ch2;
      const double exact = std::norm(reflection_coefficient(s, pi / 2.0)) * k * k / (2.0 * pi) *
                           std::tgamma(1.0 / a) / (2.0 * a) * std::pow(2.0 * k * k * Ch2, -1.0 / a);
      CHECK(kirchhoff(s, k, pi / 2.0) == Approx(exact).epsilon(1e-9));
    }
}

TEST_CASE("from 50 degrees up the formula stays within 1 dB of the Kirchhoff integral") {
  for (const char* name : {"coarse sand", "medium sand", "very fine sand", "clay"}) {
    const Sediment s = sediment_named(name);
    const double k = wavenumber_per_cm(30e3, 1528.0), a = s.alpha();
    const ReliefIntegral integral(a);
    const double qc = kirchhoff_shape(s, k).qc;
    const double R2 = std::norm(reflection_coefficient(s, pi / 2.0));
    for (double degrees = 50.0; degrees < 90.0; degrees += 0.5) {
      const double grazing = degrees * pi / 180.0;
      const double sine2 = std::pow(std::sin(grazing), 2), cosine2 = std::pow(std::cos(grazing), 2);
      const double exact =
          R2 / (8.0 * pi * sine2 * cosine2) * integral(qc * sine2 * std::pow(cosine2, -a));
      CAPTURE(name, degrees);
      CHECK(std::abs(to_db(kirchhoff(s, k, grazing) / exact)) < 1.0);
    }
  }
}

TEST_CASE("the Kirchhoff approximation is not used below 40 degrees, nor for a smooth bed") {
  Sediment s = sediment_named("medium sand");
  CHECK(kirchhoff(s, 1.2, 39.99 * pi / 180.0) == 0.0);
  CHECK(kirchhoff(s, 1.2, 40.0 * pi / 180.0) > 0.0);
  s.strength_cm4 = 0.0;
  CHECK(kirchhoff(s, 1.2, 1.5) == 0.0);
}
