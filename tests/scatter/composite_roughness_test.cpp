#include <cmath>
#include <numbers>

#include "support/catch.h"

#include <ensonify/scatter/composite_roughness.h>

using namespace ensonify::scatter;
using std::numbers::pi;

TEST_CASE("the relief below its cutoff has the slope variance of the model") {
  for (const double exponent : {2.5, 3.25, 3.8})
    for (const double frequency_hz : {30e3, 400e3}) {
      Sediment s = sediment_named("medium sand");
      s.exponent = exponent;
      const double k = wavenumber_per_cm(frequency_hz, 1500.0);
      const double cutoff_per_cm = slope_cutoff_rad_per_m(s, k) / 100.0;
      // Integral of K^2 W2(K) over the plane, by the midpoint rule over ln K.
      const double step = 0.01;
      double variance = 0.0;
      for (double ln = std::log(cutoff_per_cm) - 0.5 * step; ln > -120.0; ln -= step) {
        const double K = std::exp(ln);
        variance += step * 2.0 * pi * std::pow(K, 4) * relief_spectrum_cm4(s, K);
      }
      CAPTURE(exponent, frequency_hz);
      CHECK(std::pow(rms_slope(s, k), 2) == Approx(variance).epsilon(1e-4));
    }
}

TEST_CASE("a mesh has the fraction of a relief's slope that its spacing allows") {
  const Sediment s = sediment_named("medium sand");
  const auto k = [](double frequency_hz) { return wavenumber_per_cm(frequency_hz, 1500.0); };
  CHECK(slope_cutoff_rad_per_m(s, k(30e3)) == Approx(12.0).margin(0.5));
  CHECK(slope_cutoff_rad_per_m(s, k(100e3)) == Approx(82.0).margin(1.0));
  CHECK(slope_cutoff_rad_per_m(s, k(400e3)) == Approx(757.0).margin(8.0));
  CHECK(resolved_slope_fraction(s, k(30e3), 0.25) == 1.0);
  CHECK(resolved_slope_fraction(s, k(100e3), 0.25) == Approx(0.25).margin(0.01));
  CHECK(resolved_slope_fraction(s, k(400e3), 0.25) == Approx(0.05).margin(0.005));
  CHECK(resolved_slope_fraction(s, k(400e3), 0.05) == Approx(0.15).margin(0.006));
  CHECK(resolved_slope_fraction(s, k(400e3), 0.01) == Approx(0.52).margin(0.006));
  // The part below the mesh's limit, computed from the spectrum.
  const double fraction = resolved_slope_fraction(s, k(400e3), 0.05);
  const double limit = pi / 5.0;  // rad/cm
  const double held =
      2.0 * pi * s.strength_cm4 * std::pow(limit, 4.0 - s.exponent) / (4.0 - s.exponent);
  CHECK(fraction * std::pow(rms_slope(s, k(400e3)), 2) == Approx(held));
}

TEST_CASE("shadowing hides nothing when steep and everything at grazing") {
  CHECK(shadowing(pi / 2.0, 0.3) == 1.0);
  CHECK(shadowing(0.1, 0.0) == 1.0);
  CHECK(shadowing(1e-4, 0.2) < 0.01);
  double before = 0.0;
  for (double t = 0.001; t < 3.0; t += 0.001) {
    const double lit = shadowing(std::atan(t * 0.2), 0.2);
    REQUIRE(lit <= 1.0);
    REQUIRE(lit >= before - 1e-12);
    REQUIRE(lit - before < 0.01);
    before = lit;
  }
  // t = 1: Q = (e^-1/sqrt(pi) - erfc(1)) / 4 = 0.012564
  CHECK(shadowing(std::atan(0.2), 0.2) ==
        Approx((1.0 - std::exp(-0.0251278)) / 0.0251278).epsilon(1e-6));
}

TEST_CASE("a slope average keeps constants, and is exact for a square") {
  CHECK(slope_average([](double) { return 3.0; }, 0.7, 0.1) == Approx(3.0).epsilon(2e-6));
  // E[(g - x s)^2] with weight e^(-x^2)/sqrt(pi), whose variance is 1/2.
  CHECK(slope_average([](double g) { return g * g; }, 0.7, 0.1) ==
        Approx(0.49 + 0.5 * 0.01).epsilon(2e-6));
}
