#include <ensonify/engine/sonar/echo/ping_tracer.h>

#include <algorithm>
#include <cmath>

#include <ensonify/engine/trace/refraction/ray_bend.h>

namespace ensonify::engine {

PingTracer::PingTracer(const Sonar& sonar, const Medium& medium, const Seafloor& seafloor,
                       std::span<const scatter::BackscatterTable> material_tables,
                       const Refraction& refraction, const std::vector<Label>* moving,
                       const ObjectSurfaces& surfaces, int beam)
    : beam_(beam),
      range_m_(trace_range_m(sonar, medium.sound_speed_mps)),
      sound_speed_mps_(medium.sound_speed_mps),
      sectors_(sonar.sectors()),
      layouts_(sonar, medium.sound_speed_mps / sonar.frequency_hz),
      surfaces_(surfaces),
      former_(sonar, medium, seafloor, material_tables, moving, surfaces,
              sonar.beam_offset_m(beam)) {
  if (refraction.mode == RefractionMode::off) return;
  bend_ = bend_of(*refraction.profile, refraction.deepest_m, range_m_, medium.sound_speed_mps);
  if (refraction.mode == RefractionMode::time_only) {
    travel_time_.emplace(*refraction.profile, medium.sound_speed_mps);
    bend_ = {.lengthening = bend_.lengthening};
    return;
  }
  if (!(bend_.turn_rad > 0.0)) {  // the rays are straight
    bend_ = {};
    return;
  }
  layouts_.bend(*refraction.profile, medium.sound_speed_mps);
  refracted_.emplace(*refraction.profile, refraction.highest_m, refraction.deepest_m,
                     medium.sound_speed_mps, refraction.lists);
}

/// The range of the nearest thing: an object, or else the bed.
double PingTracer::nearest_m(const Eigen::Vector3d& from, double nearest_bed_m) const {
  double nearest_m = nearest_bed_m;
  for (const std::vector<ObjectSurface>* objects : {surfaces_.fixed, surfaces_.moving})
    if (objects) nearest_m = nearest_flat_part_m(*objects, from, nearest_m);
  return nearest_m;
}

BeamAim PingTracer::aim(const Pose& pose, double altitude_m, double nearest_bed_m,
                        const std::array<double, most_sectors>& rise_rad) {
  const double near_m = nearest_m(pose.position, std::min(altitude_m, nearest_bed_m));
  BeamAim aim{.altitude_m = altitude_m};
  for (std::size_t i = 0; i < sectors_.size(); ++i) {
    const Sector& sector = sectors_[i];
    const ReceiverMotion& motion = aim.motions[i] =
        receiver_motion(pose, sector, range_m_, sound_speed_mps_);
    aim.layouts[i] = layouts_.at(pose, sector, altitude_m, near_m,
                                 std::abs(motion.drift_along) + range_m_ * motion.array_turn.norm(),
                                 rise_rad[i]);
    aim.fans[i] = place_fan(*aim.layouts[i], pose, sector, range_m_);
    aim.fans[i].bend = bend_;
  }
  return aim;
}

bool PingTracer::trace(const BeamAim& aim, const TracedFaces& faces, std::size_t sector) {
  const RayFan& fan = aim.fans[sector];
  if (!refracted_ && faces.bed) return false;
  triangles_ = faces.triangles;
  if (!needs_hits() && faces.intersector->list_runs(fan, runs_)) return true;
  hits_.resize(fan.grid->rays());
  if (refracted_) return refracted_->trace(fan, faces, hits_);
  if (travel_time_) {
    RayFan straight = fan;  // as far as sound goes in the fan's time
    straight.range_m *= fan.bend.lengthening;
    faces.intersector->intersect(straight, hits_);
    travel_time_->apply(fan, hits_);
  } else {
    faces.intersector->intersect(fan, hits_);
    runs_.take(fan, faces.triangles, hits_);
  }
  return true;
}

const FanRuns& PingTracer::runs(const BeamAim& aim, std::size_t sector) {
  if (travel_time_) runs_.take(aim.fans[sector], triangles_, hits_);
  return runs_;
}

void PingTracer::echo(const BeamAim& aim, std::size_t sector, EchoLine& line) {
  line.sector = sector;
  line.beam = beam_;
  IncidenceSource* incidences = nullptr;
  if (refracted_) incidences = &*refracted_;
  if (travel_time_) incidences = &*travel_time_;
  if (incidences)
    former_.form(aim.fans[sector], *aim.layouts[sector], aim.motions[sector], triangles(), hits_,
                 *incidences, line);
  else
    former_.form(aim.fans[sector], *aim.layouts[sector], aim.motions[sector], triangles(), runs_,
                 line);
}

}  // namespace ensonify::engine
