#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/trace/intersector.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/ray_incidence.h>
#include <ensonify/engine/trace/refraction/straightened_bed.h>
#include <ensonify/engine/trace/refraction/straightened_space.h>
#include <ensonify/engine/trace/refraction/straightening.h>
#include <ensonify/engine/trace/traced_faces.h>
#include <ensonify/scatter/sound_ray.h>

namespace ensonify::engine {

/// How a tracer decided its bent rays, summed over its fans.
struct RefractionCounts {
  std::uint64_t rays = 0;
  std::uint64_t straightened = 0;  ///< rays decided without a chord
  std::uint64_t chords = 0;        ///< traced in place of arcs
  std::uint64_t refined = 0;       ///< hits of chords whose arc misses the face; traced finer

  RefractionCounts& operator+=(const RefractionCounts& other);
  RefractionCounts operator-(const RefractionCounts& other) const;
};

/// The rays of a fan as sound runs, bent by a sound speed profile, each in the vertical plane of
/// its launch.
///
/// Nearly all are decided in straightened space (StraightenedSpace). The others, which turn or may
/// meet what stands as high as the sonar, go in two steps, as the paper does it: a chord of the ray
/// finds the face, then the exact arc is cut with that face's plane. The sea above the highest face
/// is passed in one step. Below, a chord stands for as much of the ray as stays within a millimetre
/// of it: a curve that turns by D in all over a chord of length L strays at most L/2 tan(D/2) from
/// it. Where the arc then misses the face, which happens within that distance of an edge, chords
/// that stay within a micrometre decide. Walking across neighbouring faces from the straight ray's
/// hit would need per-ping adjacency and would visit every face between that hit and the arc; a
/// chord costs one extra ray.
class RefractedTracer final : public IncidenceSource {
 public:
  /// Faces lie between the height highest_m and the depth deepest_m. The t of hits is travel time
  /// times reference_mps. The profile must outlive this. takes_lists: the intersectors of the faces
  /// answer lists of rays; otherwise it builds a separate tree for the chords.
  RefractedTracer(const scatter::SoundSpeedProfile& profile, double highest_m, double deepest_m,
                  double reference_mps, bool takes_lists = true);

  /// Finds the nearest hits of the fan's bent rays, by ray number; rays end where their t is the
  /// fan's range. The fan and the faces must stay until the last incidence_of().
  void trace(const RayFan& fan, const Faces& faces, std::span<Hit> hits);
  /// The same over `faces`. If a bed and its objects do not decide all rays, all faces replace them
  /// in `faces`.
  void trace(const RayFan& fan, TracedFaces& faces, std::span<Hit> hits);
  /// The triangles that the hits of the last trace index.
  refine::Triangles triangles() const { return on_bed_ ? bed_->triangles() : faces_.triangles; }
  RayIncidence incidence_of(std::size_t number, Hit& hit) override;
  std::optional<RayToPlace> ray_to(const Eigen::Vector3d& origin,
                                   const Eigen::Vector3d& away) const override;

  const RefractionCounts& counts() const { return counts_; }

 private:
  /// A ray on its way; its chord runs from `from` to `to`.
  struct Course {
    scatter::SoundRay from, to;
    Eigen::Vector2d outwards;  // its horizontal direction, unit
    std::uint32_t number;
  };
  static Eigen::Vector3d place(const Course& course, const Eigen::Vector3d& origin,
                               const scatter::SoundRay& at);
  static Ray chord_of(const Course& course, const Eigen::Vector3d& origin);
  void start(const RayFan& fan, std::uint32_t number);
  void follow(const RayFan& fan, std::span<Hit> hits);
  bool trace_bed(const RayFan& fan, const BedAndObjects& faces, std::span<Hit> hits);
  const Intersector& tree();
  bool reach_faces(scatter::SoundRay& ray, double range_m) const;
  bool next_chord(Course& course, double sagitta_m, double end_path_m) const;
  double end_path_m(const scatter::SoundRay& ray, double range_m) const;
  Hit cut_arc(const Course& course, const Eigen::Vector3d& origin, const Hit& found, bool last_try,
              RayIncidence& incidence) const;
  Hit trace_finely(Course course, const RayFan& fan, RayIncidence& incidence);

  double top_m_;                        // depth of the highest face, or a little less
  scatter::SoundSpeedProfile profile_;  // with a layer's edge at that depth
  double reference_mps_;
  bool takes_lists_;
  double fastest_mps_;
  std::unique_ptr<Straightening> straightening_;
  StraightenedSpace straightened_space_;
  std::optional<StraightenedBed> bed_;
  const refine::HeightGrid* grid_ = nullptr;  // of bed_
  RefractionCounts counts_;
  std::unique_ptr<Intersector> own_tree_;
  std::optional<std::uint64_t> own_version_;

  // Of the fan that was traced last:
  Faces faces_;  // on a bed of heights, the faces of its objects
  bool on_bed_ = false;
  std::vector<Hit> of_objects_;           // hits of the objects in front of a bed
  std::vector<std::uint32_t> undecided_;  // ray numbers
  std::vector<RayIncidence> by_chords_;
  std::vector<std::uint32_t> chord_place_;  // by ray number, in by_chords_; none: straightened
  std::vector<Course> courses_;
  std::vector<Ray> chords_;
  std::vector<Hit> found_;
};

}  // namespace ensonify::engine
