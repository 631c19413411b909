#include <cmath>
#include <numbers>

#include "support/catch.h"

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/solid_target.h>

using namespace ensonify::scatter;
using std::numbers::pi;

namespace {

constexpr double nothing_db = -200.0;

double at(const Backscatter& surface, double off_normal_rad) {
  return surface.cross_section(pi / 2.0 - off_normal_rad);
}

}  // namespace

TEST_CASE("a sphere that reflects everything scatters a quarter of its radius squared") {
  const double radius_m = 2.0;
  for (const double width : {0.5 * degree, 2.0 * degree}) {
    const SolidTarget rigid({nothing_db, 1.0, width});
    double sum = 0.0;
    const double step = 1e-5;
    for (double g = 0.5 * step; g < 0.5; g += step)
      sum += at(rigid, g) * 2.0 * pi * radius_m * radius_m * std::sin(g) * step;
    CHECK(sum == Approx(radius_m * radius_m / 4.0).epsilon(1e-3));
  }
}

TEST_CASE("with the lobe of their diffraction a plate and a cylinder have their closed forms") {
  const double wavelength_m = 0.015, length_m = 0.5, radius_m = 0.2;
  const double s = wavelength_m / (2.0 * std::sqrt(pi) * length_m);
  const SolidTarget facet({nothing_db, 1.0, std::atan(s)});
  const double area_m2 = length_m * length_m;
  CHECK(at(facet, 0.0) * area_m2 == Approx(std::pow(area_m2 / wavelength_m, 2)).epsilon(1e-6));
  double sum = 0.0;
  const double step = 1e-6;
  for (double g = -0.1; g < 0.1; g += step) sum += at(facet, g) * length_m * radius_m * step;
  CHECK(sum == Approx(radius_m * length_m * length_m / (2.0 * wavelength_m)).epsilon(1e-3));
}

TEST_CASE("a mirror's specular part is 1, with the faintest diffuse part that a scene can have") {
  CHECK(SolidTarget({-100.0, 1.0, 1.0 * degree}).cross_section(0.5 * pi) > 1.0);
  CHECK_THROWS_WITH(SolidTarget({-80.0, 1.0, 1.0 * degree}), Catch::Contains("more energy"));
}

TEST_CASE("a lobe returns exactly its part of the energy") {
  // Seen along the surface's normal, a facet inclined by g reflects its energy to 2g.
  for (const double width_deg : {1.0, 5.0, 15.0}) {
    const double s2 = std::pow(std::tan(width_deg * degree), 2);
    const SolidTarget surface({nothing_db, 0.4, width_deg * degree});
    // sigma(g) = specular pdf(slopes) sec^4 / 4, with slopes tan g: over their plane the pdf is 1.
    double part = 0.0;
    const double step = 1e-5;
    for (double g = 0.5 * step; g < 1.5; g += step) {
      const double slope = std::tan(g), secant2 = 1.0 + slope * slope;
      part += 4.0 * at(surface, g) / (secant2 * secant2) * 2.0 * pi * slope * secant2 * step;
    }
    CAPTURE(width_deg, s2);
    CHECK(part == Approx(0.4).epsilon(1e-4));
  }
  CHECK_THROWS_WITH(SolidTarget({-6.0, 0.5, 0.1}), Catch::Contains("more energy than arrives"));
  CHECK_THROWS_AS(SolidTarget({-4.9, 0.0, 0.1}), std::invalid_argument);
  CHECK_NOTHROW(SolidTarget({-4.98, 0.0, 0.1}));
  CHECK_THROWS_WITH(SolidTarget({-20.0, -0.1, 0.1}), Catch::Contains("0 to 1"));
  CHECK_THROWS_WITH(SolidTarget({-20.0, 0.1, -0.1}), Catch::Contains("0 to 45"));
  CHECK_THROWS_AS(SolidTarget({std::nan(""), 0.1, 0.1}), std::invalid_argument);
}

TEST_CASE(
    "what a smooth surface reflects and what a rough one scatters make up the specular part") {
  double before = 1.0;
  for (const double width_deg : {0.0, 0.5, 2.0, 5.0, 15.0, 45.0}) {
    const Solid solid{-20.0, 0.4, width_deg * degree};
    CAPTURE(width_deg);
    CHECK(solid.smooth_specular() + solid.rough().specular == Approx(0.4));
    CHECK(solid.smooth_specular() < before);
    before = solid.smooth_specular();
  }
  CHECK(Solid{-20.0, 0.4, 0.0}.smooth_specular() == 0.4);
  // At tan = 0.05 the relief of correlation length lambda is lambda / 40 high: exp(-(pi / 10)^2).
  CHECK(Solid{-20.0, 1.0, std::atan(0.05)}.smooth_specular() == Approx(std::exp(-0.0986960)));
  // A smooth solid without its mirror is Lambert's.
  const SolidTarget rest(Solid{-20.0, 0.4, 0.0}.rough());
  CHECK(to_db(rest.cross_section(90.0 * degree)) == Approx(-20.0));
}

TEST_CASE("outside its lobe a solid follows Lambert's law") {
  const SolidTarget wood({-20.0, 0.03, 5.0 * degree});
  CHECK(to_db(wood.cross_section(30.0 * degree)) == Approx(-26.0206));
  CHECK(wood.cross_section(0.0) == 0.0);
}

TEST_CASE("every named solid is valid, and an unknown one is refused with the names") {
  for (const NamedSolid& named : named_solids()) {
    const SolidTarget target(solid_named(named.name));
    const BackscatterTable table(target);
    for (double degrees = 0.05; degrees <= 90.0; degrees += 0.05) {
      const double sine = std::sin(degrees * degree);
      CAPTURE(named.name, degrees);
      REQUIRE(std::abs(to_db(table.sigma_over_sine(sine) * sine /
                             target.cross_section(degrees * degree))) < 0.02);
    }
  }
  CHECK_THROWS_WITH(solid_named("cheese"), Catch::Contains("rubber"));
}
