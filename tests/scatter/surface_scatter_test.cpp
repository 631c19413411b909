#include <cmath>
#include <limits>
#include <numbers>

#include "support/catch.h"

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/surface_scatter.h>

using namespace ensonify::scatter;

namespace {

double surface_strength_db(const SeaSurface& surface, double grazing_deg) {
  return to_db(surface_cross_section(surface, grazing_deg * degree));
}

}  // namespace

TEST_CASE("The sea surface has TR 9407's strengths at 100 kHz at 5 m/s wind") {
  const SeaSurface surface = {.wind_mps = 5.0, .frequency_hz = 100e3};
  CHECK(surface_strength_db(surface, 10.0) == Approx(-36.8).margin(0.05));
  CHECK(surface_strength_db(surface, 30.0) == Approx(-36.0).margin(0.05));
  CHECK(surface_strength_db(surface, 60.0) == Approx(-25.4).margin(0.05));
  CHECK(surface_strength_db(surface, 90.0) == Approx(6.1).margin(0.05));
}

TEST_CASE("The sea surface agrees with a second implementation in calm and storm") {
  struct Case {
    double grazing_deg, frequency_hz, wind_mps, strength_db;
  };
  for (const auto& [grazing_deg, f, wind, expected_db] : {Case{75.0, 100e3, 5.0, -11.434313},
                                                          {70.0, 50e3, 10.0, -12.165862},
                                                          {15.0, 20e3, 12.5, -26.889520},
                                                          {80.0, 30e3, 3.0, -2.906658},
                                                          {86.0, 100e3, 15.0, -0.646672},
                                                          {5.0, 400e3, 4.0, -38.590738},
                                                          {60.0, 10e3, 0.5, -45.263205}}) {
    CAPTURE(grazing_deg, f, wind);
    CHECK(surface_strength_db({wind, f}, grazing_deg) == Approx(expected_db).margin(1e-6));
  }
  CHECK(bubble_cross_section({11.5, 10e3}, 90.0 * degree) == Approx(0.022528181761968864));
  CHECK(bubble_cross_section({13.0, 12e3}, 60.0 * degree) == Approx(0.017287918384806696));
}

TEST_CASE("Straight up the facets' strength is the inverse of 4 pi s^2 of their slopes") {
  for (const double wind : {2.0, 5.0, 15.0}) {
    const double slope2 = 4.6e-3 * std::log(2.1 * wind * wind);
    CHECK(facet_cross_section({wind, 100e3}, 90.0 * degree) ==
          Approx(1.0 / (4.0 * std::numbers::pi * slope2)));
  }
}

TEST_CASE("The facets' echo summed over all angles is the flat surface's, at any wind") {
  // For small slopes, sigma cos^4 is their density: 4 int sigma d(tan)^2 over the plane is 1.
  for (const double wind : {1.0, 3.0, 8.0}) {
    double sum = 0.0;
    constexpr int steps = 20000;
    constexpr double steepest = 2.0;
    for (int i = 0; i < steps; ++i) {
      const double slope = steepest * (i + 0.5) / steps;
      const double sine = std::cos(std::atan(slope));  // of the grazing angle
      sum += facet_cross_section({wind, 100e3}, std::asin(sine)) * std::pow(sine, 4) * 2.0 *
             std::numbers::pi * slope * steepest / steps;
    }
    CHECK(4.0 * sum == Approx(1.0).epsilon(1e-4));
  }
}

TEST_CASE("The surface's strength is finite, not negative, and zero at zero grazing") {
  for (const double wind : {0.0, 0.5, 1.0, 5.0, 6.0, 11.0, 25.0, 60.0})
    for (const double f : {1e3, 10e3, 100e3, 1e6}) {
      const SeaSurface surface = {wind, f};
      CHECK(surface_cross_section(surface, 0.0) == 0.0);
      for (double grazing = 1e-12; grazing < 90.0; grazing = grazing * 1.3 + 1e-12) {
        const double sigma = surface_cross_section(surface, grazing * degree);
        CAPTURE(wind, f, grazing);
        CHECK(sigma >= 0.0);
        CHECK(std::isfinite(sigma));
      }
      CHECK(std::isfinite(surface_cross_section(surface, std::numeric_limits<double>::min())));
      CHECK(std::isfinite(surface_cross_section(surface, std::numbers::pi / 2)));
    }
}

TEST_CASE("The strength has no jumps in the angle except the model's at 85 degrees") {
  for (const double wind : {1.0, 5.0, 10.0, 20.0})
    for (double grazing = 1.0; grazing < 89.99; grazing += 0.01) {
      CAPTURE(wind, grazing);
      const double step = std::abs(surface_strength_db({wind, 100e3}, grazing + 0.01) -
                                   surface_strength_db({wind, 100e3}, grazing));
      CHECK(step < (std::abs(grazing - 85.0) < 0.02 ? 0.25 : 0.1));
    }
}

TEST_CASE("Where the formulas change with the wind, the strength does not jump") {
  for (const double change_mps : {1.0, 6.0, 11.0})
    for (const double grazing : {5.0, 20.0, 45.0, 70.0, 80.0, 90.0}) {
      CAPTURE(change_mps, grazing);
      // The facets' slope steps by 0.4 % at 1 m/s, which moves their lobe far from vertical.
      CHECK(surface_strength_db({std::nextafter(change_mps, 0.0), 100e3}, grazing) ==
            Approx(surface_strength_db({change_mps, 100e3}, grazing)).margin(0.1));
    }
}

TEST_CASE("In a calm only the bubbles' background and the near vertical glint are left") {
  const SeaSurface calm = {.wind_mps = 0.0, .frequency_hz = 100e3};
  CHECK(ripple_cross_section(calm, 45.0 * degree) == 0.0);
  CHECK(bubble_loss_db(calm, 90.0 * degree) < 1e-3);
  CHECK(surface_strength_db(calm, 30.0) < -55.0);
  CHECK(surface_strength_db(calm, 90.0) > 10.0);
}

TEST_CASE("More wind strengthens the bubbles' echo until they are opaque, then it is constant") {
  const double grazing_rad = 20.0 * degree;
  double last = 0.0;
  for (double wind = 0.0; wind <= 7.0; wind += 0.25) {
    const double here = bubble_cross_section({wind, 100e3}, grazing_rad);
    CHECK(here > last);
    last = here;
  }
  // Eq. 7: sin(grazing) x reradiation / (8 pi damping).
  const double opaque =
      std::sin(grazing_rad) * 0.0136 / (0.0255 * std::cbrt(100.0)) / (8.0 * std::numbers::pi);
  for (double wind = 12.0; wind <= 60.0; wind += 4.0)
    CHECK(bubble_cross_section({wind, 100e3}, grazing_rad) == Approx(opaque).epsilon(1e-3));
}

TEST_CASE("A thin bubble layer scatters equally in all directions, six times its volume strength") {
  // Volume scatter: direct, by the surface's mirror image, and both mixed ways.
  const SeaSurface calm = {.wind_mps = 0.0, .frequency_hz = 25e3};
  const double thin = std::pow(10.0, -5.2577) / (4.0 * std::numbers::pi) * 0.0136 /
                      (0.0255 * std::cbrt(25.0)) * 6.0;
  CHECK(bubble_cross_section(calm, 90.0 * degree) == Approx(thin).epsilon(1e-3));
  CHECK(bubble_cross_section(calm, 45.0 * degree) == Approx(thin).epsilon(1e-3));
}

TEST_CASE("The bubbles' loss grows with the path through them, the wind and the frequency") {
  const SeaSurface surface = {.wind_mps = 10.0, .frequency_hz = 20e3};
  // 1.26e-3 x 10^1.57 x 20^0.85
  CHECK(bubble_loss_db(surface, 90.0 * degree) == Approx(0.598).margin(0.001));
  CHECK(bubble_loss_db(surface, 30.0 * degree) ==
        Approx(2.0 * bubble_loss_db(surface, 90.0 * degree)));
  for (double wind = 0.0; wind < 40.0; wind += 0.25)
    CHECK(bubble_loss_db({wind + 0.25, 20e3}, 0.5) > bubble_loss_db({wind, 20e3}, 0.5));
  CHECK(bubble_loss_db({10.0, 40e3}, 0.5) / bubble_loss_db({10.0, 20e3}, 0.5) ==
        Approx(std::pow(2.0, 0.85)));
}

TEST_CASE("Invalid surfaces are refused") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto sigma : {surface_cross_section, bubble_cross_section, facet_cross_section,
                           ripple_cross_section, bubble_loss_db}) {
    for (const double wind : {-1.0, 61.0, nan})
      CHECK_THROWS_WITH(sigma({wind, 1e5}, 0.5), Catch::Contains("0 to 60"));
    for (const double f : {0.0, -1.0, nan})
      CHECK_THROWS_WITH(sigma({5.0, f}, 0.5), Catch::Contains("more than 0"));
    for (const double grazing_rad : {-0.1, 1.6, nan})
      CHECK_THROWS_WITH(sigma({5.0, 1e5}, grazing_rad), Catch::Contains("0 to 90"));
  }
}
