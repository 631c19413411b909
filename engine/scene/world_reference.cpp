#include <ensonify/engine/scene/world_reference.h>

#include <ensonify/engine/seafloor/bed/survey.h>

namespace ensonify::engine {

std::string world_reference(const Scene& scene, const Eigen::Vector3d& world_origin) {
  std::string reference;
  if (scene.seafloor.kind == SeafloorKind::survey)
    reference = survey_reference({scene.seafloor.survey.path, scene.seafloor.survey_cell_m});
  const TrackOptions& track = scene.track;
  if (reference.empty() && track.origin_latitude_rad)
    reference =
        reference_about({*track.origin_latitude_rad, *track.origin_longitude_rad}, world_origin);
  return reference;
}

}  // namespace ensonify::engine
