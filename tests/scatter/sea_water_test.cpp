#include "support/catch.h"

#include <ensonify/scatter/sea_water.h>

using namespace ensonify::scatter;

TEST_CASE("Mackenzie's own check value: 25 degrees, 35 psu, 1000 m") {
  CHECK(sound_speed_mps({.temperature_c = 25.0, .salinity_psu = 35.0}, 1000.0) ==
        Approx(1550.744).margin(0.0005));
}

TEST_CASE("Francois and Garrison's absorption at three frequencies") {
  const auto db_per_km = [](double f, double t, double s, double d, double ph) {
    return 1000.0 * absorption_db_per_m({t, s, ph}, d, f);
  };
  CHECK(db_per_km(100e3, 27.0, 35.0, 0.0, 8.1) == Approx(35.662).epsilon(1e-4));
  CHECK(db_per_km(120e3, 12.0, 34.0, 20.0, 8.0) == Approx(40.168).epsilon(1e-4));
  CHECK(db_per_km(300e3, 15.0, 35.0, 10.0, 8.0) == Approx(85.514).epsilon(1e-4));
}

TEST_CASE("absorption grows with frequency, and fresh water absorbs less than the sea") {
  double last = 0.0;
  for (double f = 10e3; f < 1e6; f *= 1.2) {
    const double here = absorption_db_per_m({}, 20.0, f);
    CHECK(here > last);
    CHECK(absorption_db_per_m({.salinity_psu = 0.5}, 20.0, f) < here);
    last = here;
  }
}
