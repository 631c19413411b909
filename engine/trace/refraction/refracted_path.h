#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/trace/intersector.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/engine/trace/refraction/straightened_space.h>
#include <ensonify/scatter/sound_ray.h>

namespace ensonify::engine {

/// How the sound of a ray came to its hit. To the echo a bent ray is the straight one of its launch
/// direction whose length is its travel time at one reference speed; what is there of the sea is
/// stretched a little on its way to that picture, by a factor for each direction.
struct RayIncidence {
  Eigen::Vector3d place;      ///< of the hit, local metres
  Eigen::Vector3d direction;  ///< of travel there, unit
  double spreading_m2;        ///< of the way back: SoundRay::spreading_back_m2
  double absorption_db;       ///< one way
  // Metres there for one in the picture: along the ray, across it in its vertical plane, and level.
  double along, upwards, sideways;

  /// The normal of a facet there as the picture has it, for the ray's launch direction; unit.
  Eigen::Vector3d straightened(const Eigen::Vector3d& normal, const Eigen::Vector3d& launch) const;

  /// That of a neighbouring ray which goes on so many times as far, about so long a way from here.
  RayIncidence onwards(double times, const Eigen::Vector3d& way) const;
};

/// How rays came to their hits, told one by one: an echo asks for few of them.
class IncidenceSource {
 public:
  virtual ~IncidenceSource() = default;
  /// Of a hit as the tracer left it, by its ray's number in the fan that was traced last; makes its
  /// t exact, which may be within half a millimetre before. (Its u and v may be of a part of the
  /// face.)
  virtual RayIncidence tell(std::size_t number, Hit& hit) = 0;
};

/// What became of the bent rays of a tracer, summed over its fans.
struct RefractionCounts {
  std::uint64_t rays = 0;
  std::uint64_t straightened =
      0;  ///< that were decided in the picture (bent_picture.h), or go where nothing is
  std::uint64_t chords = 0;  ///< that stood for arcs
  std::uint64_t finely =
      0;  ///< hits that a chord's face did not settle, asked again by short chords

  RefractionCounts& operator+=(const RefractionCounts& other);
};

/// The rays of a fan as sound runs, bent by a sound speed profile in the vertical plane of their
/// launch.
///
/// Nearly all are straight in a picture of the seafloor that is bent instead (bent_picture.h). The
/// others, which turn or meet what stands as high as the sonar, go in two steps, as the paper has
/// it: a chord of the ray finds the face, then the exact arc is cut with that face's plane. The sea
/// above the highest face is passed at once. Below, chords stand for as much of the ray as stays
/// within sagitta_m of them: a curve that turns by D in all on a chord of length L strays at most
/// L/2 tan(D/2) from it. Where the arc then misses the face, which it does within that of an edge,
/// chords of a micrometre decide. A walk over the faces' neighbours from where the straight ray
/// hits would have to look at every face between it and the arc to know the first, and needs the
/// neighbours of every ping's faces; a chord is one more ray.
class RefractedTracer final : public IncidenceSource {
 public:
  /// `highest_m` is the height of the highest face; nothing is looked for above it. `deepest_m` is
  /// the depth of the deepest. Hits' t is travel time times `reference_mps`. The profile must
  /// outlive this.
  RefractedTracer(const scatter::SoundSpeedProfile& profile, double highest_m, double deepest_m,
                  double reference_mps, double sagitta_m = 1e-3);

  /// Nearest hits of the fan's bent rays over triangles, by ray number; rays end where their t is
  /// the fan's range. Chords are asked of `lists`, which is over those triangles, or of a tree of
  /// its own without one. Triangles of one version are the same ones. Fan and triangles must stay
  /// while hits are told.
  void trace(const RayFan& fan, const Intersector* lists, refine::Triangles triangles,
             std::uint64_t version, std::span<Hit> hits);
  RayIncidence tell(std::size_t number, Hit& hit) override;

  const RefractionCounts& counts() const { return counts_; }

 private:
  struct Course {  // a ray under way; its chord runs from `from` to `to`
    scatter::SoundRay from, to;
    Eigen::Vector2d level;  // its horizontal direction, unit
    std::uint32_t number;
  };
  /// The vertical plane's point of the sea.
  static Eigen::Vector3d place(const Course& course, const Eigen::Vector3d& origin,
                               const scatter::SoundRay& at);
  void start(const RayFan& fan, std::uint32_t number);
  void follow(const RayFan& fan, const Intersector* lists, std::span<Hit> hits);
  const Intersector& own_tree();
  bool reach_faces(scatter::SoundRay& ray, double range_m) const;
  bool next_chord(Course& course, double sagitta_m, double end_path_m) const;
  double end_path_m(const scatter::SoundRay& ray, double range_m) const;
  Hit settle(const Course& course, const Eigen::Vector3d& origin, const Hit& found, bool finely,
             RayIncidence& arrival) const;
  Hit ask_finely(Course course, const RayFan& fan, const Intersector& tree, RayIncidence& arrival);

  double top_m_;                        // depth of the highest face, or a little above
  scatter::SoundSpeedProfile profile_;  // with an edge there
  double reference_mps_, sagitta_m_;
  double fastest_mps_;
  StraightenedSpace picture_;
  RefractionCounts counts_;
  refine::Triangles triangles_;  // of the last fan
  std::uint64_t version_ = 0;
  std::unique_ptr<Intersector> own_tree_;
  std::optional<std::uint64_t> own_version_;
  std::vector<std::uint32_t> left_;  // by the picture
  bool pictured_ = false;            // the others
  std::vector<RayIncidence> by_chords_;
  std::vector<std::uint32_t> chord_place_;  // there, by ray number; none: of the picture
  std::vector<Course> courses_;
  std::vector<Ray> chords_;
  std::vector<Hit> found_;
};

/// Straight rays whose hits stay, but come when sound takes that way at the profile's speeds. The
/// quickest way is bent, and quicker by the second order of the bend only (Fermat).
class TravelTime final : public IncidenceSource {
 public:
  /// The profile must outlive this.
  TravelTime(const scatter::SoundSpeedProfile& profile, double reference_mps);
  /// Straight hits' t becomes travel time times the reference speed; those beyond the fan's range
  /// are none. The fan must stay while hits are told.
  void apply(const RayFan& fan, std::span<Hit> hits);
  RayIncidence tell(std::size_t number, Hit& hit) override;

 private:
  struct Down {
    double time_s, mps;
  };
  Down straight_down(double depth_m) const;

  const scatter::SoundSpeedProfile* profile_;
  double reference_mps_;
  std::vector<double> edge_s_;  // to each layer's top
  const RayFan* fan_ = nullptr;
  std::vector<double> straight_m_;  // by ray number
};

/// How far bent rays leave their straight ones; every ray of a profile stays within.
FanBend bend(const scatter::SoundSpeedProfile& profile, double deepest_m, double range_m,
             double reference_mps);

}  // namespace ensonify::engine
