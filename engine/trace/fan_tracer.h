#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <ensonify/engine/trace/fan_runs.h>
#include <ensonify/engine/trace/ray.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/ray_incidence.h>
#include <ensonify/engine/trace/refraction/refracted_tracer.h>
#include <ensonify/engine/trace/refraction/refraction_mode.h>
#include <ensonify/engine/trace/refraction/travel_time.h>
#include <ensonify/engine/trace/traced_faces.h>
#include <ensonify/refine/triangle_mesh.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// How the layered sea changes rays; the same for all pings.
struct Refraction {
  RefractionMode mode = RefractionMode::off;
  const scatter::SoundSpeedProfile* profile = nullptr;
  double highest_m = 0.0;  ///< height of the highest face
  double deepest_m = 0.0;  ///< depth of the deepest face
  bool lists = true;       ///< the intersectors answer lists of rays
};

/// What the rays of a fan hit first: straight rays as runs, other rays as hits by ray number.
struct FanHits {
  refine::Triangles triangles;    ///< which runs and hits index
  const FanRuns* runs = nullptr;  ///< null if `hits` are given instead
  std::span<const Hit> hits = {};
  IncidenceSource* incidences = nullptr;  ///< how bent or delayed rays arrive
};

/// Traces fans, one at a time, along straight or bent rays. A fan is traced once, however many
/// receive beams listen to it. It keeps its memory from fan to fan.
class FanTracer {
 public:
  /// `range_m` is the range of the fans. The refraction's profile must outlive this.
  FanTracer(const Refraction& refraction, double range_m, double sound_speed_mps);

  /// The value that RayFan::bend of the fans must have.
  const FanBend& bend() const { return bend_; }
  /// Whether its rays bend; then faces come from FaceSource::prepare_bed().
  bool bends() const { return refracted_.has_value(); }
  /// Whether its rays bend or have other travel times, so that it needs hits, not runs.
  bool needs_hits() const { return refracted_ || travel_time_; }

  /// Finds what a fan hits. The fan is the `number`th (from 0) of those that the faces were
  /// prepared for. The fan and the faces must exist as long as the result, which is valid until the
  /// next call. If a bed and its objects do not decide all rays, all faces replace them in `faces`.
  const FanHits& trace(const RayFan& fan, std::size_t number, TracedFaces& faces);
  /// The runs of the fan that was traced last; valid until the next trace(). Not for bent rays.
  const FanRuns& runs(const RayFan& fan);

  /// How the bent rays of all fans so far were decided.
  RefractionCounts refraction_counts() const {
    return refracted_ ? refracted_->counts() : RefractionCounts{};
  }

 private:
  FanBend bend_;
  std::optional<RefractedTracer> refracted_;  // at most one of these two is set
  std::optional<TravelTime> travel_time_;
  FanRuns runs_;  // of straight rays
  std::vector<Hit> hits_;
  FanHits found_;
};

}  // namespace ensonify::engine
