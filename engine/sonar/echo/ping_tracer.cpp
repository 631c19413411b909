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
      sides_(sides_of(sonar)),
      layouts_(sonar, medium.sound_speed_mps / sonar.frequency_hz),
      surfaces_(surfaces),
      former_(sonar, medium, seafloor, material_tables, moving, surfaces,
              sonar.beam_offset_m(beam)),
      lists_(refraction.lists) {
  if (refraction.mode == RefractionMode::time_only)
    travel_time_.emplace(*refraction.profile, medium.sound_speed_mps);
  if (refraction.mode != RefractionMode::full) return;
  bend_ = bend_of(*refraction.profile, refraction.deepest_m, range_m_, medium.sound_speed_mps);
  if (!(bend_.turn_rad > 0.0)) {  // straight after all
    bend_ = {};
    return;
  }
  layouts_.bend(*refraction.profile, medium.sound_speed_mps);
  refracted_.emplace(*refraction.profile, refraction.highest_m, refraction.deepest_m,
                     medium.sound_speed_mps);
}

/// The range of the nearest thing: an object, or else the bed.
double PingTracer::nearest_m(const Eigen::Vector3d& from, double nearest_bed_m) const {
  double nearest_m = nearest_bed_m;
  for (const std::vector<ObjectSurface>* objects : {surfaces_.fixed, surfaces_.moving})
    if (objects) nearest_m = nearest_flat_part_m(*objects, from, nearest_m);
  return nearest_m;
}

std::span<const RayFan> PingTracer::aim(const Pose& pose, double altitude_m, double nearest_bed_m,
                                        const std::array<double, 2>& rise_rad) {
  const double near_m = nearest_m(pose.position, std::min(altitude_m, nearest_bed_m));
  layouts_.keep_few();
  for (const Side side : sides_) {
    const auto i = static_cast<std::size_t>(side);
    const ReceiverMotion& motion = receptions_[i] =
        receiver_motion(pose, side, range_m_, sound_speed_mps_);
    aims_[i] = &layouts_.at(altitude_m, near_m, roll_tilt_rad(pose, side),
                            std::abs(motion.drift_along) + range_m_ * motion.array_turn.norm(),
                            rise_rad[i], -pose.position.z());
    fans_[i] = place_fan(*aims_[i], pose, side, range_m_);
    fans_[i].bend = bend_;
    hits_.resize(fans_[i].grid->rays());
  }
  return std::span(fans_).subspan(static_cast<std::size_t>(sides_.front()), sides_.size());
}

void PingTracer::trace(const Intersector& intersector, refine::Triangles triangles,
                       std::uint64_t version, Side side) {
  const RayFan& fan = fans_[static_cast<std::size_t>(side)];
  if (refracted_)
    return refracted_->trace(fan, lists_ ? &intersector : nullptr, triangles, version, hits_);
  if (!travel_time_ && intersector.list_runs(fan, runs_)) return;
  intersector.intersect(fan, hits_);
  if (travel_time_)
    travel_time_->apply(fan, hits_);
  else
    runs_.take(fan, triangles, hits_);
}

const FanRuns& PingTracer::runs(refine::Triangles triangles, Side side) {
  if (travel_time_) runs_.take(fan(side), triangles, hits_);
  return runs_;
}

void PingTracer::echo(refine::Triangles triangles, Side side, EchoLine& line) {
  line.side = side;
  line.beam = beam_;
  const auto i = static_cast<std::size_t>(side);
  IncidenceSource* incidences = nullptr;
  if (refracted_) incidences = &*refracted_;
  if (travel_time_) incidences = &*travel_time_;
  if (incidences)
    former_.form(fans_[i], *aims_[i], receptions_[i], triangles, hits_, *incidences, line);
  else
    former_.form(fans_[i], *aims_[i], receptions_[i], triangles, runs_, line);
}

}  // namespace ensonify::engine
