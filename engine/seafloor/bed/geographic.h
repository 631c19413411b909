#pragma once

#include <Eigen/Core>

namespace ensonify::engine {

/// Latitude north and longitude east, WGS 84.
struct GeographicPlace {
  double latitude_rad = 0.0;
  double longitude_rad = 0.0;

  bool operator==(const GeographicPlace&) const = default;
};

/// A place on a map: metres east and north, and the direction of the map's north there.
struct MapPlace {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double convergence_rad = 0.0;  ///< direction of the map's north, clockwise from true north
};

/// The place in a UTM zone, 1 to 60, negative in the south. Uses GeographicLib. Throws
/// std::invalid_argument for a place that is too far from the zone or not on Earth, and in a build
/// without that library.
MapPlace utm_place(const GeographicPlace& where, int zone);

/// The place on the plane that touches the ellipsoid at an origin. Uses GeographicLib; throws as
/// utm_place does.
MapPlace tangent_place(const GeographicPlace& where, const GeographicPlace& origin);

/// A place of a map on the ellipsoid.
struct PlaceOnEarth {
  GeographicPlace where;
  double convergence_rad = 0.0;  ///< direction of the map's north, clockwise from true north
};

/// The inverse of utm_place. Throws as it does.
PlaceOnEarth place_of_utm(const Eigen::Vector2d& place, int zone);
/// The inverse of tangent_place, for places on the ellipsoid. Throws as it does.
PlaceOnEarth place_of_tangent(const Eigen::Vector2d& place, const GeographicPlace& origin);

}  // namespace ensonify::engine
