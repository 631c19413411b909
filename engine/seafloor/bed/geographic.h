#pragma once

#include <Eigen/Core>

namespace ensonify::engine {

/// Latitude north and longitude east, WGS 84.
struct GeographicPlace {
  double latitude_rad = 0.0;
  double longitude_rad = 0.0;

  bool operator==(const GeographicPlace&) const = default;
};

/// A place on a map in metres east and north, and the direction of the map's north at this place.
struct MapPlace {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double convergence_rad = 0.0;  ///< direction of the map's north, clockwise from true north
};

/// The place in the map of a UTM zone (1 to 60, negative in the south). Uses GeographicLib. Throws
/// std::invalid_argument for a place that is too far from the zone or not on Earth, and in a build
/// without GeographicLib.
MapPlace utm_place(const GeographicPlace& where, int zone);

/// The place in the plane that touches the ellipsoid at `origin`. Uses GeographicLib. Throws as
/// utm_place().
MapPlace tangent_place(const GeographicPlace& where, const GeographicPlace& origin);

/// A place on the ellipsoid, and the direction of a map's north at this place.
struct PlaceOnEarth {
  GeographicPlace where;
  double convergence_rad = 0.0;  ///< direction of the map's north, clockwise from true north
};

/// The inverse of utm_place(). Throws as utm_place().
PlaceOnEarth place_of_utm(const Eigen::Vector2d& place, int zone);
/// The inverse of tangent_place(). Throws as tangent_place().
PlaceOnEarth place_of_tangent(const Eigen::Vector2d& place, const GeographicPlace& origin);

}  // namespace ensonify::engine
