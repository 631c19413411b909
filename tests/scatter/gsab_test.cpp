#include <cmath>
#include <limits>

#include "support/catch.h"

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/gsab.h>

using namespace ensonify::scatter;

namespace {

double at_incidence_db(const Gsab& gsab, double incidence_deg) {
  return to_db(GsabBottom(gsab).cross_section((90.0 - incidence_deg) * degree));
}

}  // namespace

TEST_CASE("the generic model is the sum of its lobes and of its Lambert-like part") {
  const Gsab all{.specular = from_db(-5.0),
                 .specular_width_rad = 3.0 * degree,
                 .lambert = from_db(-25.0),
                 .lambert_exponent = 1.5,
                 .transitional = from_db(-15.0),
                 .transitional_width_rad = 12.0 * degree};
  for (const double t : {0.0, 1.0, 3.0, 10.0, 25.0, 60.0, 89.0}) {
    CAPTURE(t);
    const double sum = std::pow(10.0, -0.5) * std::exp(-t * t / (2.0 * 3.0 * 3.0)) +
                       std::pow(10.0, -2.5) * std::pow(std::cos(t * degree), 1.5) +
                       std::pow(10.0, -1.5) * std::exp(-t * t / (2.0 * 12.0 * 12.0));
    CHECK(at_incidence_db(all, t) == Approx(10.0 * std::log10(sum)));
  }
}

TEST_CASE("without lobes and with the power 2 the generic model is Lambert's law") {
  const Lambert law(-22.0);
  for (const double g : {0.5, 10.0, 45.0, 90.0})
    CHECK(GsabBottom({.lambert = from_db(-22.0)}).cross_section(g * degree) ==
          Approx(law.cross_section(g * degree)));
}

TEST_CASE("a lobe is 2.17 dB lower at its width and 10 dB lower at 2.15 widths") {
  const Gsab lobe{.specular = 1.0, .specular_width_rad = 4.0 * degree};
  CHECK(at_incidence_db(lobe, 4.0) == Approx(-10.0 * std::log10(std::exp(0.5))));
  CHECK(at_incidence_db(lobe, 4.0 * std::sqrt(2.0 * std::log(10.0))) == Approx(-10.0));
}

TEST_CASE("a generic model with a lobe without width or a negative level is refused") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(GsabBottom({.specular = 1.0}), Catch::Contains("specular_width_rad is 0"));
  CHECK_THROWS_WITH(GsabBottom({.transitional = 1.0, .transitional_width_rad = nan}),
                    Catch::Contains("transitional_width_rad is nan"));
  CHECK_THROWS_WITH(GsabBottom({.lambert = -1.0}), Catch::Contains("lambert is -1"));
  CHECK_THROWS_WITH(GsabBottom({.lambert_exponent = 21.0}), Catch::Contains("0 to 20"));
  CHECK_NOTHROW(GsabBottom({}));
}
