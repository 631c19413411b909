#include <cmath>
#include <numbers>

#include "support/catch.h"

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/energy_bound.h>
#include <ensonify/scatter/gsab.h>
#include <ensonify/scatter/solid_target.h>

using namespace ensonify::scatter;
using std::numbers::pi;

namespace {

/// A sum of Lambert's law and something else over the angle from vertical.
template <class Extra>
class Sum final : public Backscatter {
 public:
  Sum(double mu, Extra extra) : mu_(mu), extra_(extra) {}
  double cross_section(double grazing_rad) const override {
    const double sine = std::sin(grazing_rad);
    return mu_ * sine * sine + extra_(pi / 2.0 - grazing_rad);
  }

 private:
  double mu_;
  Extra extra_;
};

/// The part that a diffuse material returns, by energy_bound.h: its bistatic cross-section summed
/// over rings of the hemisphere.
double returned_part(const Backscatter& material, double grazing_rad) {
  constexpr int rings = 20000;
  double sum = 0.0;
  for (int i = 0; i < rings; ++i) {
    const double g = (i + 0.5) / rings * pi / 2.0;
    const double ring = 2.0 * pi * std::cos(g) * (pi / 2.0 / rings);
    sum += std::sqrt(material.cross_section(grazing_rad) * material.cross_section(g)) * ring;
  }
  return sum / std::sin(grazing_rad);
}

}  // namespace

TEST_CASE("the diffuse bound is Lambert's law that returns all") {
  CHECK(to_db(diffuse_bound(20.0 * degree)) == Approx(-14.29).margin(0.005));
  CHECK(to_db(diffuse_bound(30.0 * degree)) == Approx(-10.99).margin(0.005));
  CHECK(to_db(diffuse_bound(45.0 * degree)) == Approx(-7.98).margin(0.005));
  CHECK_FALSE(energy_excess(Lambert(10.0 * std::log10(1.0 / pi) - 1e-9)));
  const auto none = [](double) { return 0.0; };
  const auto excess = energy_excess(Sum(from_db(2.0) / pi, none));
  REQUIRE(excess);
  CHECK(excess->excess_db == Approx(2.0).margin(1e-3));
}

TEST_CASE("a lobe at vertical may stand above the diffuse bound until all energy returns") {
  // Hagfors's facets of slope variance s^2 that reflect a part of the energy; the rest is diffuse.
  const double s2 = std::pow(std::tan(4.0 * degree), 2.0);
  const auto facets = [&](double part, double diffuse_part) {
    return Sum(diffuse_part / pi, [s2, part](double incidence_rad) {
      const double tangent = std::tan(incidence_rad), cosine = std::cos(incidence_rad);
      return part * std::exp(-tangent * tangent / s2) / (4.0 * pi * s2 * std::pow(cosine, 4.0));
    });
  };
  CHECK(to_db(facets(0.9, 0.0).cross_section(pi / 2.0)) > to_db(diffuse_bound(pi / 2.0)) + 15.0);
  CHECK_FALSE(energy_excess(facets(0.99, 0.0)));
  CHECK_FALSE(energy_excess(facets(0.49, 0.5)));
  for (const double part : {0.6, 1.2, 3.0}) {
    const auto excess = energy_excess(facets(part, 0.5));
    REQUIRE(excess);
    CHECK(excess->grazing_rad == Approx(pi / 2.0));
    CHECK(excess->excess_db == Approx(to_db(part + 0.5)).margin(0.01));
  }
  for (const NamedSolid& named : named_solids())
    CHECK_FALSE(energy_excess(SolidTarget(named.solid)));
}

TEST_CASE("a diffuse bed under the bound at all angles returns no more than arrives") {
  const auto waves = [](double incidence_rad) {
    const double cosine = std::cos(incidence_rad);
    return (0.5 + 0.4 * std::sin(9.0 * incidence_rad)) * cosine * cosine / pi;
  };
  const Sum bed(0.05 / pi, waves);
  CHECK_FALSE(energy_excess(bed));
  for (double angle = 5.0; angle <= 90.0; angle += 5.0)
    CHECK(returned_part(bed, angle * degree) <= 1.0);
  CHECK(returned_part(Lambert(-15.0), 40.0 * degree) == Approx(pi * from_db(-15.0)));
}

TEST_CASE("a bed that reflects towards the sonar is found although it returns little elsewhere") {
  const auto hump = [](double incidence_rad) {
    const double off = (incidence_rad - 60.0 * degree) / (3.0 * degree);
    return from_db(-7.0) * std::exp(-off * off);
  };
  const Sum bed(1e-4, hump);
  CHECK(returned_part(bed, 30.0 * degree) < 1.0);
  const auto excess = energy_excess(bed);
  REQUIRE(excess);
  CHECK(excess->grazing_rad / degree == Approx(30.0).margin(0.6));
  CHECK(excess->excess_db == Approx(4.0).margin(0.05));
}

TEST_CASE("every named sediment is under its bound, except the handbook's rock") {
  for (const NamedSediment& named : named_sediments())
    for (const double frequency_hz : {10e3, 30e3, 100e3, 400e3, 1e6}) {
      CAPTURE(named.name, frequency_hz);
      const Bottom bed(named.sediment, frequency_hz, 1500.0);
      const auto excess = energy_excess(bed);
      if (!named.name.starts_with("handbook")) CHECK_FALSE(excess);
      if (named.name.starts_with("handbook") && frequency_hz >= 100e3) CHECK(excess);
    }
  // TR 9407's rough rock at 100 kHz: -6.2 dB at 20 degrees.
  const Bottom rough(sediment_named("handbook rough rock"), 100e3, 1500.0);
  CHECK(to_db(rough.cross_section(20.0 * degree)) == Approx(-6.2).margin(0.1));
  CHECK(energy_excess(rough)->excess_db > 8.0);
}
