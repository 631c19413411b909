#include <ensonify/engine/seafloor/bed/reference_map.h>

#include <cmath>
#include <memory>
#include <stdexcept>

#include <cpl_error.h>
#include <fmt/format.h>
#include <ogr_spatialref.h>

#include <ensonify/engine/base/units.h>

namespace ensonify::engine {

namespace {

using GeographicOfMap = std::function<GeographicPlace(double east_m, double north_m)>;

using Transformation = std::shared_ptr<OGRCoordinateTransformation>;

/// The transformation from the system to WGS 84 (`to_earth`) or back; east or longitude is first.
/// Null if place_of_reference() is empty.
Transformation transformation_of(const std::string& reference, bool to_earth) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  OGRSpatialReference map, earth;
  if (map.importFromWkt(reference.c_str()) != OGRERR_NONE) return {};
  map.StripVertical();
  earth.SetWellKnownGeogCS("WGS84");
  for (OGRSpatialReference* system : {&map, &earth})
    system->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return Transformation(to_earth ? OGRCreateCoordinateTransformation(&map, &earth)
                                 : OGRCreateCoordinateTransformation(&earth, &map));
}

/// A function from the system to WGS 84; empty if place_of_reference() is empty.
GeographicOfMap geographic_of(const std::string& reference) {
  const Transformation to_earth = transformation_of(reference, true);
  if (!to_earth) return {};
  return [to_earth](double east_m, double north_m) {
    double longitude_deg = east_m, latitude_deg = north_m;
    if (!to_earth->Transform(1, &longitude_deg, &latitude_deg))
      throw std::invalid_argument(
          fmt::format("{} m east and {} m north are off the map of the survey's coordinate "
                      "reference system, expected a survey within it",
                      east_m, north_m));
    return GeographicPlace{latitude_deg * degree, longitude_deg * degree};
  };
}

constexpr double step_m = 100.0;  // over this distance the map's north hardly turns

}  // namespace

PlaceOfMap place_of_reference(const std::string& reference) {
  const GeographicOfMap where = geographic_of(reference);
  if (!where) return {};
  return [where](const Eigen::Vector2d& place) {
    const GeographicPlace here = where(place.x(), place.y());
    const Eigen::Vector2d north = tangent_place(where(place.x(), place.y() + step_m), here).place;
    return PlaceOnEarth{here, std::atan2(north.x(), north.y())};
  };
}

MapOfPlace map_of_reference(const std::string& reference) {
  const PlaceOfMap back = place_of_reference(reference);
  const Transformation to_map = transformation_of(reference, false);
  if (!back || !to_map) return {};
  return [back, to_map](const GeographicPlace& where) {
    double east_m = where.longitude_rad / degree, north_m = where.latitude_rad / degree;
    const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
    if (!to_map->Transform(1, &east_m, &north_m))
      throw std::invalid_argument(
          "this place is off the map of the survey's coordinate reference system");
    const Eigen::Vector2d place(east_m, north_m);
    return MapPlace{place, back(place).convergence_rad};
  };
}

bool is_on_map(const std::string& reference, const Eigen::Vector2d& place) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  const Transformation to_earth = transformation_of(reference, true);
  double east_m = place.x(), north_m = place.y();
  return !to_earth || to_earth->Transform(1, &east_m, &north_m);
}

std::optional<double> scale_of_reference(const std::string& reference,
                                         const Eigen::Vector2d& place) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  const GeographicOfMap where = geographic_of(reference);
  if (!where) return std::nullopt;
  try {
    const GeographicPlace here = where(place.x(), place.y()),
                          there = where(place.x(), place.y() + step_m);
    constexpr double earth_radius_m = 6371e3;
    return earth_radius_m / step_m *
           std::hypot(there.latitude_rad - here.latitude_rad,
                      (there.longitude_rad - here.longitude_rad) * std::cos(here.latitude_rad));
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

}  // namespace ensonify::engine
