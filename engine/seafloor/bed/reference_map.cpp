#include <ensonify/engine/seafloor/bed/reference_map.h>

#include <cmath>
#include <memory>
#include <stdexcept>

#include <cpl_error.h>
#include <fmt/format.h>
#include <ogr_spatialref.h>

#include <ensonify/engine/units.h>

namespace ensonify::engine {

PlaceOfMap place_of_reference(const std::string& reference) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
  OGRSpatialReference map, earth;
  if (map.importFromWkt(reference.c_str()) != OGRERR_NONE) return {};
  map.StripVertical();
  earth.SetWellKnownGeogCS("WGS84");
  for (OGRSpatialReference* system : {&map, &earth})  // east or longitude first
    system->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::shared_ptr<OGRCoordinateTransformation> to_earth(
      OGRCreateCoordinateTransformation(&map, &earth));
  if (!to_earth) return {};
  const auto where = [to_earth](double east_m, double north_m) {
    double longitude_deg = east_m, latitude_deg = north_m;
    if (!to_earth->Transform(1, &longitude_deg, &latitude_deg))
      throw std::invalid_argument(
          fmt::format("{} m east and {} m north are off the map of the survey's coordinate "
                      "reference system, expected a survey within it",
                      east_m, north_m));
    return GeographicPlace{latitude_deg * degree, longitude_deg * degree};
  };
  return [where](const Eigen::Vector2d& place) {
    const GeographicPlace here = where(place.x(), place.y());
    constexpr double step_m = 100.0;  // along which the map's north hardly turns
    const Eigen::Vector2d north = tangent_place(where(place.x(), place.y() + step_m), here).place;
    return PlaceOnEarth{here, std::atan2(north.x(), north.y())};
  };
}

}  // namespace ensonify::engine
