#include <ensonify/engine/seafloor/bed/ripples.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "engine/seafloor/spectrum.h"
#include "support/catch.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

using std::numbers::pi;

Heightfield ripples(const RippleRelief& relief, std::uint64_t seed) {
  Heightfield field = flat(256, 200, 0.25, 0.32);
  add_ripples(field, relief, seed);
  return field;
}

}  // namespace

TEST_CASE("The spectrum of ripples has its maximum at the wavelength, across the crests") {
  for (const double heading_deg : {30.0, 0.0, 90.0, -70.0}) {
    const double heading = heading_deg * pi / 180.0;
    const RippleRelief relief{.rms_height_m = 0.1,
                              .wavelength_m = 2.5,
                              .across_crests_rad = heading,
                              .relative_width = 0.1};
    Spectrum mean(256, 200, 0.25, 0.32);
    for (std::uint64_t seed = 1; seed <= 12; ++seed) mean.add(ripples(relief, seed));
    // East is the sine of a heading and north its cosine.
    const double k0 = 2.0 * pi / 2.5;
    const double k0x = k0 * std::sin(heading), k0y = k0 * std::cos(heading);
    double most = 0.0, at_x = 0.0, at_y = 0.0, here = 0.0, mirrored = 0.0;
    mean.each([&](double kx, double ky, double power) {
      if (power > most) most = power, at_x = kx, at_y = ky;
      const auto near = [&](double x, double y) {
        return std::min(std::hypot(kx - x, ky - y), std::hypot(kx + x, ky + y)) < 0.1 * k0;
      };
      if (near(k0x, k0y)) here += power;
      if (near(-k0x, k0y)) mirrored += power;
    });
    INFO("heading " << heading_deg);
    CHECK(std::min(std::hypot(at_x - k0x, at_y - k0y), std::hypot(at_x + k0x, at_y + k0y)) <
          0.08 * k0);
    if (heading_deg == 30.0) CHECK(here > 30.0 * mirrored);
  }
}

TEST_CASE("Ripples have the requested rms height and a mean of zero") {
  for (const double wavelength : {1.5, 8.0}) {
    double square = 0.0;
    constexpr int seeds = 16;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const Heightfield field = ripples({.rms_height_m = 0.06,
                                         .wavelength_m = wavelength,
                                         .across_crests_rad = 1.0,
                                         .relative_width = 0.15,  // enough crests to average over
                                         .hurst = 0.7},
                                        seed);
      double mean = 0.0;
      for (const double z : field.z_m) {
        mean += z / static_cast<double>(field.z_m.size());
        square += z * z / (seeds * static_cast<double>(field.z_m.size()));
      }
      CHECK(mean == Approx(0.0).margin(1e-12));
    }
    CHECK(std::sqrt(square) == Approx(0.06).epsilon(0.06));
  }
}

TEST_CASE("Regular ripples have the requested rms height, however their wavelength fits the grid") {
  for (const double wavelength : {10.0, 10.17}) {
    double square = 0.0;
    constexpr int seeds = 40;  // a narrow field is nearly one wave of random height
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      Heightfield field = flat(200, 140, 1.0, 1.0);
      add_ripples(field,
                  {.rms_height_m = 0.05,
                   .wavelength_m = wavelength,
                   .across_crests_rad = 0.5 * pi,
                   .relative_width = 0.01},
                  seed);
      for (const double z : field.z_m)
        square += z * z / (seeds * static_cast<double>(field.z_m.size()));
    }
    CAPTURE(wavelength);
    CHECK(std::sqrt(square) == Approx(0.05).epsilon(0.2));
  }
}

TEST_CASE("Ripples are the same for the same seed and independent of the relief's noise") {
  const RippleRelief relief{.rms_height_m = 0.06, .wavelength_m = 2.0};
  CHECK(ripples(relief, 4).z_m == ripples(relief, 4).z_m);
  CHECK(ripples(relief, 4).z_m != ripples(relief, 5).z_m);
}

TEST_CASE("Impossible ripples are refused, and ripples of height zero need no fine cells") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const RippleRelief& wrong :
       {RippleRelief{.rms_height_m = -0.1}, RippleRelief{.rms_height_m = nan},
        RippleRelief{.rms_height_m = 0.1, .wavelength_m = 0.0},
        RippleRelief{.rms_height_m = 0.1, .wavelength_m = nan},
        RippleRelief{.rms_height_m = 0.1, .wavelength_m = 2.0, .across_crests_rad = nan},
        RippleRelief{.rms_height_m = 0.1, .wavelength_m = 2.0, .relative_width = 0.0},
        RippleRelief{.rms_height_m = 0.1, .wavelength_m = 2.0, .hurst = 0.0},
        RippleRelief{.rms_height_m = 0.1, .wavelength_m = 1.2}})  // cells of 0.32 m
    CHECK_THROWS_AS(ripples(wrong, 1), std::invalid_argument);
  CHECK_NOTHROW(ripples({.rms_height_m = 0.1, .wavelength_m = 1.28}, 1));
  for (const double z : ripples({.rms_height_m = 0.0, .wavelength_m = 0.01}, 1).z_m)
    REQUIRE(z == 0.0);
}
