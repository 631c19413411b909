#include <ensonify/engine/seafloor/bed/geographic.h>

#include <stdexcept>

#ifdef ENSONIFY_GEOGRAPHICLIB
#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/UTMUPS.hpp>

#include <ensonify/engine/units.h>
#endif

namespace ensonify::engine {

#ifdef ENSONIFY_GEOGRAPHICLIB

namespace {

void check(const GeographicPlace& where) {
  if (!(where.latitude_rad >= -90.0 * degree && where.latitude_rad <= 90.0 * degree &&
        where.longitude_rad >= -360.0 * degree && where.longitude_rad <= 360.0 * degree))
    throw std::invalid_argument(
        "no such place on Earth, expected a latitude from -90 to 90 and a longitude from -360 to "
        "360 degrees");
}

}  // namespace

MapPlace utm_place(const GeographicPlace& where, int zone) {
  check(where);
  constexpr double southern_m = 10e6;  // added to northings in the south
  try {
    int its_zone = 0;
    bool north = true;
    double convergence_deg = 0.0, scale = 1.0;
    MapPlace map;
    GeographicLib::UTMUPS::Forward(where.latitude_rad / degree, where.longitude_rad / degree,
                                   its_zone, north, map.place.x(), map.place.y(), convergence_deg,
                                   scale, zone < 0 ? -zone : zone);
    if (north != (zone > 0)) map.place.y() += zone > 0 ? -southern_m : southern_m;
    map.convergence_rad = convergence_deg * degree;
    return map;
  } catch (const GeographicLib::GeographicErr& error) {
    throw std::invalid_argument(error.what());
  }
}

MapPlace tangent_place(const GeographicPlace& where, const GeographicPlace& origin) {
  check(where);
  check(origin);
  const GeographicLib::LocalCartesian plane(origin.latitude_rad / degree,
                                            origin.longitude_rad / degree);
  MapPlace map;
  double up_m = 0.0;
  plane.Forward(where.latitude_rad / degree, where.longitude_rad / degree, 0.0, map.place.x(),
                map.place.y(), up_m);
  return map;
}

PlaceOnEarth place_of_utm(const Eigen::Vector2d& place, int zone) {
  try {
    double latitude_deg = 0.0, longitude_deg = 0.0, convergence_deg = 0.0, scale = 1.0;
    GeographicLib::UTMUPS::Reverse(zone < 0 ? -zone : zone, zone > 0, place.x(), place.y(),
                                   latitude_deg, longitude_deg, convergence_deg, scale);
    return {{latitude_deg * degree, longitude_deg * degree}, convergence_deg * degree};
  } catch (const GeographicLib::GeographicErr& error) {
    throw std::invalid_argument(error.what());
  }
}

PlaceOnEarth place_of_tangent(const Eigen::Vector2d& place, const GeographicPlace& origin) {
  check(origin);
  const GeographicLib::LocalCartesian plane(origin.latitude_rad / degree,
                                            origin.longitude_rad / degree);
  double latitude_deg = 0.0, longitude_deg = 0.0, up_m = 0.0;
  plane.Reverse(place.x(), place.y(), 0.0, latitude_deg, longitude_deg, up_m);
  return {{latitude_deg * degree, longitude_deg * degree}, 0.0};
}

#else

namespace {
[[noreturn]] void refuse() {
  throw std::invalid_argument(
      "this program was built without GeographicLib, which converts latitudes and longitudes: "
      "install libgeographiclib-dev and build it again, or give metres (x_m,y_m or "
      "easting_m,northing_m)");
}
}  // namespace

MapPlace utm_place(const GeographicPlace&, int) { refuse(); }
MapPlace tangent_place(const GeographicPlace&, const GeographicPlace&) { refuse(); }
PlaceOnEarth place_of_utm(const Eigen::Vector2d&, int) { refuse(); }
PlaceOnEarth place_of_tangent(const Eigen::Vector2d&, const GeographicPlace&) { refuse(); }

#endif

}  // namespace ensonify::engine
