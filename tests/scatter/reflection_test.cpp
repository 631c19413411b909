#include <cmath>
#include <complex>
#include <numbers>

#include "support/catch.h"

#include <ensonify/scatter/composite_roughness.h>
#include <ensonify/scatter/reflection.h>

using namespace ensonify::scatter;
using std::numbers::pi;

TEST_CASE("medium sand reflects as in the handbook's equations") {
  const Sediment s = sediment_of_grain_size(1.5);
  CHECK(std::abs(reflection_coefficient(s, pi / 2.0)) == Approx(0.369775).margin(5e-7));
  const std::complex<double> R = reflection_coefficient(s, pi / 6.0);
  CHECK(R.real() == Approx(0.80803).margin(5e-6));
  CHECK(R.imag() == Approx(-0.33739).margin(5e-6));
}

TEST_CASE("no bed reflects more than arrives, and at grazing all of it returns inverted") {
  for (const NamedSediment& named : named_sediments())
    for (double loss : {named.sediment.loss, 0.0, 0.1}) {
      Sediment s = named.sediment;
      s.loss = loss;
      CAPTURE(named.name, loss);
      for (double degrees = 0.0; degrees <= 90.0; degrees += 0.05) {
        const double magnitude = std::abs(reflection_coefficient(s, degrees * pi / 180.0));
        REQUIRE(magnitude <= 1.0 + 1e-12);
      }
      CHECK(std::abs(reflection_coefficient(s, 0.0) + 1.0) < 1e-6);
    }
}

TEST_CASE(
    "reflection has its limits: impedance at vertical, total below the critical angle, none") {
  Sediment s{.density_ratio = 2.0, .sound_speed_ratio = 1.25};
  // Two media without loss: (Z2 - Z1) / (Z2 + Z1) at vertical.
  CHECK(reflection_coefficient(s, pi / 2.0).real() == Approx((2.5 - 1.0) / (2.5 + 1.0)));
  CHECK(reflection_loss_db(s, pi / 2.0) == Approx(-20.0 * std::log10(1.5 / 3.5)));
  const double critical = std::acos(1.0 / 1.25);
  CHECK(reflection_loss_db(s, 0.999 * critical) == Approx(0.0).margin(1e-12));
  CHECK(reflection_loss_db(s, 1.001 * critical) > 0.1);
  // Water.
  const Sediment water{.density_ratio = 1.0, .sound_speed_ratio = 1.0};
  for (const double grazing : {0.0, 0.1, 1.0, pi / 2.0})
    CHECK(std::abs(reflection_coefficient(water, grazing)) < 1e-12);
  // Brewster's angle of a slow, dense bed: rho sin = sqrt(1/nu^2 - cos^2).
  const Sediment slow{.density_ratio = 1.2, .sound_speed_ratio = 0.95};
  const double cos2 = (1.44 - 1.0 / 0.9025) / (1.44 - 1.0);
  CHECK(std::abs(reflection_coefficient(slow, std::acos(std::sqrt(cos2)))) < 1e-12);
}

TEST_CASE("sediment volume is continuous as the loss goes to zero") {
  for (const char* name : {"medium sand", "clay"}) {
    Sediment none = sediment_named(name), little = none;
    none.loss = 0.0;
    little.loss = 1e-7;
    for (const double degrees : {5.0, 45.0, 90.0}) {
      const double grazing = degrees * pi / 180.0;
      CHECK(flat_sediment_volume(none, grazing) ==
            Approx(flat_sediment_volume(little, grazing)).epsilon(1e-3).margin(1e-9));
    }
  }
}
