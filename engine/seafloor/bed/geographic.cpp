#include <ensonify/engine/seafloor/bed/geographic.h>

#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#ifdef ENSONIFY_GEOGRAPHICLIB
#include <GeographicLib/LocalCartesian.hpp>
#include <GeographicLib/TransverseMercator.hpp>

#include <ensonify/engine/base/units.h>
#endif

namespace ensonify::engine {

#ifdef ENSONIFY_GEOGRAPHICLIB

namespace {

constexpr double most_from_middle_deg = 30.0;  // the series is exact to nanometres there

double middle_of_zone_deg(int zone) { return 6.0 * std::abs(zone) - 183.0; }

Eigen::Vector2d false_origin_m(int zone) { return {500e3, zone > 0 ? 0.0 : 10e6}; }

/// The direction of a plane's north at a place, clockwise from true north. The columns of `axes`
/// are east, north and up at the place, in the axes of the plane.
double convergence_rad(const std::vector<double>& axes) { return std::atan2(axes[3], axes[4]); }

void check(const GeographicPlace& where) {
  if (!(where.latitude_rad >= -90.0 * degree && where.latitude_rad <= 90.0 * degree &&
        where.longitude_rad >= -360.0 * degree && where.longitude_rad <= 360.0 * degree))
    throw std::invalid_argument(
        "no such place on Earth, expected a latitude from -90 to 90 and a longitude from -360 to "
        "360 degrees");
}

}  // namespace

// Places beyond the zone's limits are allowed: surveys of a whole country may use one zone.
MapPlace utm_place(const GeographicPlace& where, int zone) {
  check(where);
  const double from_middle_deg =
      std::remainder(where.longitude_rad / degree - middle_of_zone_deg(zone), 360.0);
  if (std::abs(from_middle_deg) > most_from_middle_deg)
    throw std::invalid_argument(
        fmt::format("longitude {:g} is {:.0f} degrees from the middle of UTM zone {}, expected at "
                    "most {:g}",
                    where.longitude_rad / degree, std::abs(from_middle_deg), std::abs(zone),
                    most_from_middle_deg));
  double convergence_deg = 0.0, scale = 1.0;
  MapPlace map;
  GeographicLib::TransverseMercator::UTM().Forward(
      middle_of_zone_deg(zone), where.latitude_rad / degree, where.longitude_rad / degree,
      map.place.x(), map.place.y(), convergence_deg, scale);
  map.place += false_origin_m(zone);
  map.convergence_rad = convergence_deg * degree;
  return map;
}

MapPlace tangent_place(const GeographicPlace& where, const GeographicPlace& origin) {
  check(where);
  check(origin);
  const GeographicLib::LocalCartesian plane(origin.latitude_rad / degree,
                                            origin.longitude_rad / degree);
  MapPlace map;
  double up_m = 0.0;
  std::vector<double> axes(9);
  plane.Forward(where.latitude_rad / degree, where.longitude_rad / degree, 0.0, map.place.x(),
                map.place.y(), up_m, axes);
  map.convergence_rad = convergence_rad(axes);
  return map;
}

PlaceOnEarth place_of_utm(const Eigen::Vector2d& place, int zone) {
  constexpr double farthest_m = 3.5e6;  // about most_from_middle_deg at the equator
  const Eigen::Vector2d from_middle = place - false_origin_m(zone);
  if (!(std::abs(from_middle.x()) <= farthest_m && std::abs(from_middle.y()) <= 10e6))
    throw std::invalid_argument(
        fmt::format("{:.0f} m east and {:.0f} m north lie outside UTM zone {}", place.x(),
                    place.y(), std::abs(zone)));
  double latitude_deg = 0.0, longitude_deg = 0.0, convergence_deg = 0.0, scale = 1.0;
  GeographicLib::TransverseMercator::UTM().Reverse(middle_of_zone_deg(zone), from_middle.x(),
                                                   from_middle.y(), latitude_deg, longitude_deg,
                                                   convergence_deg, scale);
  return {{latitude_deg * degree, longitude_deg * degree}, convergence_deg * degree};
}

PlaceOnEarth place_of_tangent(const Eigen::Vector2d& place, const GeographicPlace& origin) {
  check(origin);
  const GeographicLib::LocalCartesian plane(origin.latitude_rad / degree,
                                            origin.longitude_rad / degree);
  double latitude_deg = 0.0, longitude_deg = 0.0, up_m = 0.0;
  std::vector<double> axes(9);
  plane.Reverse(place.x(), place.y(), 0.0, latitude_deg, longitude_deg, up_m, axes);
  return {{latitude_deg * degree, longitude_deg * degree}, convergence_rad(axes)};
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
