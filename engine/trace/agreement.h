#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/trace/intersector.h>
#include <ensonify/engine/trace/surface.h>

namespace ensonify::engine {

/// What becomes of one ray's answer when it is held against the reference's, from best to worst. A ray
/// that passes several faces on its way counts as the worst of them.
enum class Verdict {
  same,  ///< the same face, and t within rounding; or both miss
  tie,   ///< another face at the same place: a shared edge or corner, a duplicate
  end,   ///< hit or not at t_min or t_max, within rounding
  edge,  ///< another place, or none, along a silhouette: an edge passes within reach of the ray
  leak,  ///< went through the surface within reach of an edge, where the surface is on all sides
  coplanar,  ///< a hit or none, or another t, on a face whose plane the ray lies in
  unexplained
};
inline constexpr std::array verdict_names{"same", "tie",      "end",        "edge",
                                          "leak", "coplanar", "unexplained"};

/// Judges answers about rays through triangles. "Rounding" and "reach" are what arithmetic in float may
/// do to a sound answer. Let e be 2^-24, r the distance to the hit and M the largest number at hand: the
/// origin's largest coordinate plus that of the face as seen from it, in metres.
///
/// - Float moves the ray, or the face, sideways by about e M. Edge functions carry that over the face's
///   area as the ray sees it, N.d with N = (b-a)x(c-a), so the point of t, and that of u and v, are
///   off by e M L^2 / |N.d|, L being the longest edge: much on needles and on faces seen edge on. The
///   tolerance is 8 times that. Where it exceeds L, and the ray is within reach of the face's plane, it
///   lies in that plane as far as float can tell: all edge functions vanish, and rounding decides
///   whether it is met, and where.
/// - Reach, how far from the ray an edge matters, is 1e-6 r + 4 e M. A ray outside of a face is within reach
///   of it if it is of every edge's line that it is beyond: of a needle's tip that is farther away.
class Judge {
 public:
  /// The reference answers lists of rays, exactly; both must outlive this.
  Judge(refine::Triangles triangles, const Intersector& reference)
      : triangles_(triangles), reference_(reference) {}

  Verdict judge(const Ray& ray, const Hit& expected, const Hit& found) const;

  /// How far, in metres, a sound float answer may lie from the exact one on that face.
  double tolerance_m(const Ray& ray, std::uint32_t face) const;

 private:
  struct Sight;  // a face as a ray sees it
  Sight look(const Ray& ray, std::uint32_t face) const;
  static bool points_agree(const Sight& sight, const Hit& hit);
  bool surface_all_around(const Sight& sight, const Hit& hit) const;
  Verdict judge_same_face(const Sight& sight, const Hit& expected, const Hit& found) const;
  Verdict judge_passed(const Sight& sight, const Hit& hit) const;
  Hit ask(const Ray& ray) const;

  refine::Triangles triangles_;
  const Intersector& reference_;
};

/// What is compared: one surface with one intersector on it.
struct Candidate {
  std::string surface, intersector;                ///< their names, for the table
  std::function<std::unique_ptr<Surface>()> make;  ///< one worker's own
  bool has_every_face = true;         ///< whatever the fans: so lists of rays may be asked too
  std::uint64_t every = 1;            ///< asked one ray of so many, if more than 1 as a list
  std::uint64_t every_aimed_fan = 1;  ///< and one of so many of those
};

/// Where a comparison's rays come from.
enum class RaySource { scene, aimed_fans, aimed_rays };
inline constexpr std::array ray_source_names{"scene", "aimed_fans", "aimed_rays"};

/// One ray that two intersectors see differently.
struct Difference {
  Ray ray;
  Hit expected, found;
};

/// One line of the table.
struct AgreementRow {
  std::string surface, intersector;
  RaySource source = RaySource::scene;
  std::uint64_t rays = 0;
  std::array<std::uint64_t, verdict_names.size()> verdicts{};  ///< rays by Verdict
  // Over the rays that are the same: the largest difference in t.
  double largest_dt_m = 0.0;
  double largest_dt_relative = 0.0;      ///< to t, but for hits within rounding of the origin
  double largest_dt_of_tolerance = 0.0;  ///< to Judge::tolerance_m
  std::vector<Difference> unexplained;   ///< the first few

  std::uint64_t count(Verdict verdict) const { return verdicts[static_cast<std::size_t>(verdict)]; }
  AgreementRow& operator+=(const AgreementRow& other);
};

/// Of a fan's rays, those that are compared.
std::uint64_t rays_within_beam(const FanGrid& grid);

/// How far a comparison is, and what it has found till then, in the answers of all candidates.
struct AgreementProgress {
  std::uint64_t rays = 0, of = 0;
  std::uint64_t unexplained = 0, leaks = 0;
};

struct AgreementOptions {
  std::uint64_t seed = 1;
  std::uint64_t aimed_fan_rays = 0;  ///< about so many in fans whose tables go through the mesh
  std::uint64_t aimed_rays = 0;      ///< so many in lists (for both see adversarial_rays.h)
  int threads = 1;                   ///< no number changes the result
  /// Told how far it is, from one thread at a time. Returning false ends the comparison: its rows are of
  /// the rays that were asked till then.
  std::function<bool(const AgreementProgress&)> progress;
};

/// Asks every candidate and the reference the same rays: the scene's fans, and rays aimed at the
/// mesh's weak places. A row for each candidate and source of rays that it was asked; one that refuses
/// lists of rays has none for those. Throws std::invalid_argument for an empty mesh, and what
/// intersectors throw.
std::vector<AgreementRow> compare(refine::Triangles triangles, const Intersector& reference,
                                  std::span<const Candidate> candidates,
                                  std::span<const RayFan> scene_fans,
                                  const AgreementOptions& options);

}  // namespace ensonify::engine
