#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/bed/geographic.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "support/catch.h"

using namespace ensonify::engine;

namespace {

bool missing_library() {
  try {
    utm_place({0.0, 0.0}, 31);
  } catch (const std::invalid_argument& error) {
    if (std::string(error.what()).find("GeographicLib") == std::string::npos) throw;
    WARN("skipped: built without GeographicLib");
    return true;
  }
  return false;
}

}  // namespace

TEST_CASE("a place in UTM and its convergence are the published ones") {
  if (missing_library()) return;
  // The CN Tower: 43 38 33.24 N, 79 23 13.7 W is 630084 m east, 4833438 m north in zone 17
  // (Wikipedia, Universal Transverse Mercator coordinate system).
  const GeographicPlace tower{(43.0 + 38.0 / 60.0 + 33.24 / 3600.0) * degree,
                              -(79.0 + 23.0 / 60.0 + 13.7 / 3600.0) * degree};
  const MapPlace map = utm_place(tower, 17);
  CHECK(map.place.x() == Approx(630084.0).margin(1.0));
  CHECK(map.place.y() == Approx(4833438.0).margin(1.0));
  // Convergence is about (longitude - 81 W) sin(latitude) near the zone's middle.
  CHECK(map.convergence_rad ==
        Approx((tower.longitude_rad + 81.0 * degree) * std::sin(tower.latitude_rad)).epsilon(1e-3));
  CHECK_THROWS_AS(utm_place(tower, 40), std::invalid_argument);
  CHECK_THROWS_AS(utm_place({2.0, 0.0}, 31), std::invalid_argument);
}

TEST_CASE("a zone's map continues beyond it: a country's surveys may use one") {
  if (missing_library()) return;
  for (const double longitude_deg : {5.2, 10.0, 31.0}) {  // Norway in zone 33
    CAPTURE(longitude_deg);
    const GeographicPlace where{60.4 * degree, longitude_deg * degree};
    const MapPlace map = utm_place(where, 33);
    // To third order, of a sphere, within the ellipsoid's difference from it.
    const double off_rad = (longitude_deg - 15.0) * degree, cosine = std::cos(where.latitude_rad);
    const double east_m = 0.9996 * 6387e3 * std::atanh(cosine * std::sin(off_rad));
    CHECK(map.place.x() - 500e3 == Approx(east_m).epsilon(2e-3));
    const PlaceOnEarth back = place_of_utm(map.place, 33);
    CHECK(back.where.latitude_rad == Approx(where.latitude_rad).epsilon(1e-12));
    CHECK(back.where.longitude_rad == Approx(where.longitude_rad).epsilon(1e-12));
    CHECK(back.convergence_rad == Approx(map.convergence_rad));
  }
  CHECK(utm_place({60.4 * degree, 5.2 * degree}, 33).place.x() < 0.0);
}

TEST_CASE("UTM coordinates continue across the equator in the hemisphere of the zone") {
  if (missing_library()) return;
  const double north_m = utm_place({1e-6, 3.0 * degree}, 31).place.y();
  const double south_m = utm_place({-1e-6, 3.0 * degree}, 31).place.y();
  CHECK(north_m == Approx(-south_m).epsilon(1e-6));
  CHECK(utm_place({1e-6, 3.0 * degree}, -31).place.y() == Approx(10e6 + north_m));
}

TEST_CASE(
    "on the tangent plane a small arc has the length that follows from the ellipsoid's curvature") {
  if (missing_library()) return;
  const GeographicPlace origin{45.0 * degree, 10.0 * degree};
  const double a = 6378137.0, e2 = 0.0066943799901413165;
  const double w = 1.0 - e2 * 0.5;  // 1 - e^2 sin^2
  const double arc_rad = 1e-5;
  const MapPlace north =
      tangent_place({origin.latitude_rad + arc_rad, origin.longitude_rad}, origin);
  CHECK(north.place.y() == Approx(arc_rad * a * (1.0 - e2) / std::pow(w, 1.5)).epsilon(1e-5));
  CHECK(north.place.x() == Approx(0.0).margin(1e-6));
  const MapPlace east =
      tangent_place({origin.latitude_rad, origin.longitude_rad + arc_rad}, origin);
  CHECK(east.place.x() ==
        Approx(arc_rad * a / std::sqrt(w) * std::cos(origin.latitude_rad)).epsilon(1e-5));
}

TEST_CASE("away from its origin, the north of a tangent plane is not true north") {
  if (missing_library()) return;
  const GeographicPlace origin{78.0 * degree, 15.0 * degree};
  const PlaceOnEarth place = place_of_tangent({8000.0, -3000.0}, origin);
  // Meridians converge by the difference in longitude times the sine of the latitude.
  CHECK(place.convergence_rad / degree ==
        Approx((place.where.longitude_rad - origin.longitude_rad) / degree *
               std::sin(place.where.latitude_rad))
            .epsilon(1e-3));
  CHECK(place.convergence_rad > 0.3 * degree);
  CHECK(tangent_place(place.where, origin).convergence_rad ==
        Approx(place.convergence_rad).epsilon(1e-9));
  // The azimuth of a short way to the plane's north.
  const PlaceOnEarth north = place_of_tangent({8000.0, -2990.0}, origin);
  const Eigen::Vector2d way = tangent_place(north.where, place.where).place;
  CHECK(std::atan2(way.x(), way.y()) == Approx(place.convergence_rad).epsilon(1e-4));
  CHECK(place_of_tangent({0.0, 0.0}, origin).convergence_rad == Approx(0.0).margin(1e-12));
  // Beyond the pole it is south.
  const PlaceOnEarth beyond = place_of_tangent({0.0, 100.0}, {90.0 * degree, 0.0});
  CHECK(std::abs(beyond.convergence_rad) == Approx(180.0 * degree));
}
