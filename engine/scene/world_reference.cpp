#include <ensonify/engine/scene/world_reference.h>

#include <ensonify/engine/seafloor/bed/survey.h>

namespace ensonify::engine {

std::optional<GeographicPlace> given_origin(const TrackOptions& track) {
  if (!track.origin_latitude_rad || !track.origin_longitude_rad) return std::nullopt;
  return GeographicPlace{*track.origin_latitude_rad, *track.origin_longitude_rad};
}

std::string world_reference(const std::string& of_bed, const Eigen::Vector3d& world_origin,
                            const std::optional<GeographicPlace>& middle) {
  return of_bed.empty() && middle ? reference_about(*middle, world_origin) : of_bed;
}

}  // namespace ensonify::engine
