#include <cmath>
#include <limits>
#include <numbers>

#include "support/catch.h"

#include <ensonify/scatter/ambient_noise.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify::scatter;

TEST_CASE("Each source of noise has its level at 1 kHz, where the logarithm is zero") {
  CHECK(turbulence_noise_db(1e3) == Approx(17.0));
  CHECK(shipping_noise_db(1e3, 0.5) == Approx(40.0 - 60.0 * std::log10(1.03)));
  CHECK(wind_noise_db(1e3, 4.0) == Approx(65.0 - 40.0 * std::log10(1.4)));
  CHECK(thermal_noise_db(1e3) == Approx(-15.0));
}

TEST_CASE("Noise rises and falls with frequency as each source's formula") {
  const double decade = 10.0;
  CHECK(turbulence_noise_db(50.0 * decade) - turbulence_noise_db(50.0) == Approx(-30.0));
  CHECK(thermal_noise_db(1e5 * decade) - thermal_noise_db(1e5) == Approx(20.0));
  // Far above their knees at 30 and 400 Hz, ships lose 34 and wind 20 dB a decade.
  CHECK(shipping_noise_db(1e5 * decade, 0.5) - shipping_noise_db(1e5, 0.5) ==
        Approx(-34.0).margin(0.01));
  CHECK(wind_noise_db(1e5 * decade, 5.0) - wind_noise_db(1e5, 5.0) == Approx(-20.0).margin(0.2));
}

TEST_CASE("Thermal noise agrees with Mellen's thermodynamics within 0.5 dB") {
  constexpr double boltzmann = 1.380649e-23, temperature_k = 283.0, density = 1026.0, c = 1490.0;
  for (const double f : {50e3, 200e3, 900e3}) {
    const double pa2_per_hz =
        4.0 * std::numbers::pi * boltzmann * temperature_k * density * f * f / c;
    const double exact_db = to_db(pa2_per_hz * 1e12);
    CHECK(thermal_noise_db(f) < exact_db);
    CHECK(thermal_noise_db(f) == Approx(exact_db).margin(0.5));
  }
}

TEST_CASE("The total noise is above its loudest source, by at most 6 dB (four equal sources)") {
  for (double f = 1.0; f < 1e6; f *= 1.5)
    for (const double wind : {0.0, 5.0, 20.0})
      for (const double shipping : {0.0, 1.0}) {
        const double loudest = std::max({turbulence_noise_db(f), shipping_noise_db(f, shipping),
                                         wind_noise_db(f, wind), thermal_noise_db(f)});
        const double all = ambient_noise_db(f, wind, shipping);
        CAPTURE(f, wind, shipping);
        CHECK(all > loudest);
        CHECK(all < loudest + 6.03);
      }
}

TEST_CASE("Each source dominates its band") {
  CHECK(ambient_noise_db(2.0, 5.0, 0.5) == Approx(turbulence_noise_db(2.0)).margin(0.2));
  CHECK(ambient_noise_db(50.0, 0.0, 1.0) == Approx(shipping_noise_db(50.0, 1.0)).margin(0.2));
  CHECK(ambient_noise_db(5e3, 10.0, 0.5) == Approx(wind_noise_db(5e3, 10.0)).margin(0.2));
  CHECK(ambient_noise_db(600e3, 5.0, 0.5) == Approx(thermal_noise_db(600e3)).margin(0.2));
  // At 10 m/s, thermal noise exceeds the wind's from between 100 and 300 kHz.
  CHECK(thermal_noise_db(100e3) < wind_noise_db(100e3, 10.0));
  CHECK(thermal_noise_db(300e3) > wind_noise_db(300e3, 10.0));
}

TEST_CASE("More wind and more ships are louder, a calm sea is not silent") {
  for (double wind = 0.0; wind < 59.0; wind += 1.0)
    CHECK(ambient_noise_db(20e3, wind + 1.0, 0.5) > ambient_noise_db(20e3, wind, 0.5));
  for (double shipping = 0.0; shipping < 0.95; shipping += 0.1)
    CHECK(ambient_noise_db(100.0, 5.0, shipping + 0.1) > ambient_noise_db(100.0, 5.0, shipping));
  CHECK(shipping_noise_db(200.0, 1.0) - shipping_noise_db(200.0, 0.0) == Approx(20.0));
  CHECK(std::isfinite(ambient_noise_db(100e3, 0.0, 0.0)));
}

TEST_CASE("Invalid seas are refused") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double f : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()})
    CHECK_THROWS_AS(ambient_noise_db(f, 5.0, 0.5), std::invalid_argument);
  for (const double wind : {-0.1, 61.0, nan})
    CHECK_THROWS_WITH(ambient_noise_db(1e5, wind, 0.5), Catch::Contains("0 to 60"));
  for (const double shipping : {-0.1, 1.1, nan})
    CHECK_THROWS_WITH(ambient_noise_db(1e5, 5.0, shipping), Catch::Contains("0 (none near) to 1"));
}
