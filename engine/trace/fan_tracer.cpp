#include <ensonify/engine/trace/fan_tracer.h>

#include <ensonify/engine/trace/intersector.h>
#include <ensonify/engine/trace/refraction/bent_ranges.h>

namespace ensonify::engine {

FanTracer::FanTracer(const Refraction& refraction, double range_m, double sound_speed_mps) {
  if (refraction.mode == RefractionMode::off) return;
  const FanBend bend = bend_of(*refraction.profile, refraction.deepest_m, range_m, sound_speed_mps);
  if (refraction.mode == RefractionMode::time_only) {
    bend_ = {.lengthening = bend.lengthening};
    travel_time_.emplace(*refraction.profile, sound_speed_mps);
  } else if (bend.turn_rad > 0.0) {  // otherwise the rays are straight
    bend_ = bend;
    refracted_.emplace(*refraction.profile, refraction.highest_m, refraction.deepest_m,
                       sound_speed_mps, refraction.lists);
  }
}

const FanHits& FanTracer::trace(const RayFan& fan, std::size_t number, TracedFaces& faces) {
  found_ = {};
  if (!needs_hits() && list_runs(faces, fan, number, runs_)) {
    found_ = {.triangles = triangles_of(faces), .runs = &runs_};
    return found_;
  }
  hits_.resize(fan.grid->rays());
  if (refracted_) {
    refracted_->trace(fan, faces, hits_);
    found_ = {.triangles = refracted_->triangles(), .hits = hits_, .incidences = &*refracted_};
    return found_;
  }
  const Faces& all = all_faces(faces);
  if (travel_time_) {
    RayFan straight = fan;  // as far as sound can travel in the time of the range
    straight.range_m *= fan.bend.lengthening;
    all.intersector->intersect(straight, hits_);
    travel_time_->apply(fan, hits_);
    found_ = {.triangles = all.triangles, .hits = hits_, .incidences = &*travel_time_};
  } else {
    all.intersector->intersect(fan, hits_);
    runs_.take(fan, all.triangles, hits_);
    found_ = {.triangles = all.triangles, .runs = &runs_};
  }
  return found_;
}

const FanRuns& FanTracer::runs(const RayFan& fan) {
  if (!found_.runs) runs_.take(fan, found_.triangles, hits_);
  return runs_;
}

}  // namespace ensonify::engine
