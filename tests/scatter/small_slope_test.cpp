#include <cmath>
#include <numbers>

#include "support/catch.h"

#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/composite_roughness.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/kirchhoff.h>
#include <ensonify/scatter/small_slope.h>

using namespace ensonify::scatter;
using std::numbers::pi;

TEST_CASE("the relief integral has its closed forms at alpha 1/2 and 1") {
  const ReliefIntegral half(0.5), one(1.0);
  for (double p = 1e-14; p < 1e8; p *= 3.7) {
    CAPTURE(p);
    CHECK(half(p) == Approx(p * std::pow(1.0 + p * p, -1.5)).epsilon(1e-10));
    CHECK(one(p) == Approx(std::exp(-0.25 / p) / (2.0 * p)).epsilon(1e-9).margin(1e-13));
  }
}

TEST_CASE("the relief integral equals that along the real axis") {
  for (const double alpha : {0.3, 0.625, 0.7, 0.95})
    for (const double p : {3.0, 10.0, 1e3}) {
      // Simpson's rule over the cube root of u, which makes u^(2 alpha) smooth enough at 0.
      const double end = std::pow(std::pow(45.0 / p, 0.5 / alpha), 1.0 / 3.0);
      const int steps = 20000;
      double sum = 0.0;
      for (int i = 1; i <= steps; ++i) {
        const double v = end * i / steps, u = v * v * v;
        const double f =
            std::cyl_bessel_j(0.0, u) * std::exp(-p * std::pow(u, 2.0 * alpha)) * u * 3.0 * v * v;
        sum += f * (i == steps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0);
      }
      CAPTURE(alpha, p);
      CHECK(ReliefIntegral(alpha)(p) == Approx(sum * end / steps / 3.0).epsilon(1e-8));
    }
}

TEST_CASE("the relief integral has the right limits for small and large p") {
  for (const double alpha : {0.2, 0.4, 0.625, 0.8, 0.95}) {
    const ReliefIntegral integral(alpha);
    CAPTURE(alpha);
    for (const double p : {1e-7, 1e-13})
      CHECK(integral(p) == Approx(-p * std::pow(2.0, 1.0 + 2.0 * alpha) * std::tgamma(1.0 + alpha) /
                                  std::tgamma(-alpha))
                               .epsilon(1e-5));
    const double p = 1e9;
    CHECK(
        integral(p) ==
        Approx(std::tgamma(1.0 / alpha) / (2.0 * alpha) * std::pow(p, -1.0 / alpha)).epsilon(1e-5));
  }
}

TEST_CASE(
    "small-slope equals Kirchhoff at vertical and perturbation theory of gentle relief elsewhere") {
  for (const NamedSediment& named : named_sediments())
    for (const double frequency_hz : {10e3, 100e3, 1e6}) {
      CAPTURE(named.name, frequency_hz);
      const SmallSlope model(named.sediment, frequency_hz, 1500.0);
      const double k = wavenumber_per_cm(frequency_hz, 1500.0);
      CHECK(std::abs(to_db(model.cross_section(pi / 2.0) /
                           kirchhoff(named.sediment, k, pi / 2.0))) < 0.02);
    }
  Sediment gentle = sediment_named("fine sand");
  gentle.strength_cm4 = 1e-6;
  const SmallSlope model(gentle, 30e3, 1500.0);
  for (const double degrees : {0.01, 1.0, 20.0, 45.0, 60.0}) {
    CAPTURE(degrees);
    const double grazing = degrees * pi / 180.0;
    const double cosine = std::cos(grazing);
    // perturbation()'s spectrum is kept finite at vertical; this one's is not.
    const double spectra = std::pow(1.0 + 0.0025 / (cosine * cosine), 0.5 * gentle.exponent);
    CHECK(std::abs(to_db(
              model.cross_section(grazing) /
              (spectra * perturbation(gentle, wavenumber_per_cm(30e3, 1500.0), grazing)))) < 0.02);
  }
}

TEST_CASE("the small-slope model is smooth from grazing to vertical") {
  for (const char* name : {"rough rock", "medium sand", "clay"})
    for (const double frequency_hz : {10e3, 1e6}) {
      const Bottom bed(sediment_named(name), frequency_hz, 1500.0, "small-slope");
      double before_db = 0.0;
      for (double degrees = 0.5; degrees <= 90.0; degrees += 0.1) {
        const double strength_db = to_db(bed.cross_section(degrees * pi / 180.0));
        CAPTURE(name, frequency_hz, degrees);
        REQUIRE(std::isfinite(strength_db));
        if (degrees > 0.5) REQUIRE(std::abs(strength_db - before_db) < 4.0);
        before_db = strength_db;
      }
      CHECK(bed.cross_section(0.0) >= 0.0);
    }
}
