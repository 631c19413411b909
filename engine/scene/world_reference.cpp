#include <ensonify/engine/scene/world_reference.h>

#include <ensonify/engine/seafloor/bed/survey.h>

namespace ensonify::engine {

std::optional<GeographicPlace> given_origin(const TrackOptions& track) {
  if (!track.origin_latitude_rad || !track.origin_longitude_rad) return std::nullopt;
  return GeographicPlace{*track.origin_latitude_rad, *track.origin_longitude_rad};
}

std::string world_reference(const Scene& scene, const Eigen::Vector3d& world_origin,
                            const std::optional<GeographicPlace>& middle) {
  std::string reference;
  if (scene.seafloor.kind == SeafloorKind::survey)
    reference = survey_reference({scene.seafloor.survey.path, scene.seafloor.survey_cell_m});
  if (reference.empty() && middle) reference = reference_about(*middle, world_origin);
  return reference;
}

}  // namespace ensonify::engine
