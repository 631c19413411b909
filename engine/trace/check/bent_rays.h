#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/trace/check/fan_comparison.h>
#include <ensonify/engine/trace/check/judge.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/refracted_tracer.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// The water that bends the rays of a scene.
struct BentWater {
  const scatter::SoundSpeedProfile* profile = nullptr;  ///< null: rays are straight
  double highest_m = 0.0;                               ///< height of the highest face
  double reference_mps = 0.0;  ///< the t of a hit is travel time times this speed
};

/// A bent ray of a fan and its hit by the reference.
struct BentRay {
  std::size_t number;  ///< of the ray in its fan
  Ray launch;          ///< unit direction at the sonar; t_max is the range
  Hit expected;
};

/// The reference for bent rays. It traces chords that stray at most a hundredth of a millimetre
/// from the ray with an exact intersector. The first chord that hits gives the face; then the arc
/// is intersected with the plane of that face. It shares only the arcs (scatter::SoundRay) with
/// RefractedTracer. A ray takes 3 to 12 µs on one core.
class BentReference {
 public:
  /// The intersector must be exact and must answer lists of rays over the triangles, whose numbers
  /// are their places. The profile, the triangles and the intersector must outlive this.
  BentReference(const BentWater& water, refine::Triangles triangles, const Intersector& exact);

  /// The first hit of the bent ray that starts as `launch`, whose direction is unit.
  Hit trace(const Ray& launch) const;
  /// One in `every` rays within the beam of a fan, from the `turn`-th on, with their hits. Adds
  /// the fan's rays to `turn`.
  std::vector<BentRay> trace_some(const RayFan& fan, std::uint64_t every,
                                  std::uint64_t& turn) const;

  /// Traces the fan over these faces with a run's tracer, and compares the hits of `some` of its
  /// rays.
  void compare(const RayFan& fan, std::span<const BentRay> some, RefractedTracer& tracer,
               TracedFaces& faces, AgreementCounts& tally) const;
  /// Judges the hit that a run finds for a bent ray. A run decides within a millimetre which face a
  /// ray hits: so a tie is another face within a millimetre, an end is a hit or a miss within a
  /// millimetre of the range, and an edge is a hit that this reference finds for a ray that passes
  /// a millimetre beside it. In each case the hit must be in the plane of its face within a tenth
  /// of a millimetre, and on the face within a millimetre. Where the face is the expected one, t
  /// must be right within a tenth of a millimetre.
  Verdict judge(const BentRay& ray, const Hit& found) const;

 private:
  double off_plane_m(std::uint32_t face, const Eigen::Vector3d& point) const;
  bool is_on_face(const Ray& launch, const Hit& found) const;

  BentWater water_;
  refine::Triangles triangles_;
  const Intersector& exact_;
};

}  // namespace ensonify::engine
