#pragma once

#include <array>
#include <cstdint>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Whether two hits have the same face, t, u and v, or both are misses. Hit::index may differ.
bool same_bits(const Hit& a, const Hit& b);

/// The result of comparing one answer with the reference's, from best to worst. A ray that passes
/// several faces gets the worst verdict of them.
enum class Verdict {
  same,      ///< the same face, and t within rounding; or both miss
  tie,       ///< another face at the same place: a shared edge or corner, a duplicate
  end,       ///< one hit and one miss at t_min or t_max, within rounding
  edge,      ///< another place, or a miss, at a silhouette: the ray is within reach of an edge
  leak,      ///< passed through the surface, within reach of an edge with surface on all sides
  coplanar,  ///< a hit, a miss or another t on a face whose plane contains the ray
  unexplained
};
inline constexpr std::array verdict_names{"same", "tie",      "end",        "edge",
                                          "leak", "coplanar", "unexplained"};

/// Judges answers about rays through triangles. "Rounding" and "reach" bound what float arithmetic
/// may do to a correct answer. Let e be 2^-24, r the distance to the hit and M the largest number
/// in the computation, in metres: the largest coordinate of the ray's origin relative to the middle
/// of the mesh, plus the face's largest coordinate relative to the ray's origin, plus half the
/// mesh's size. (The back-end's own origin is at the mesh.)
///
/// Rounding: float moves the ray, or the face, sideways by about e M. Edge functions divide that by
/// the face's area as the ray sees it, N.d with N = (b-a)x(c-a). So t, u and v are those of a point
/// that is off by e M L^2 / |N.d|, where L is the longest edge: a large error for needles and for
/// faces seen edge on. The tolerance is 8 times that. If it exceeds L, and the ray is within reach
/// of the face's plane, the ray lies in that plane as far as float can resolve: all edge functions
/// vanish, and rounding decides whether and where it hits.
///
/// Reach: an edge matters to a ray that passes within 1e-6 r + 4 e M of it. A ray outside a face is
/// within reach of the face if it is within reach of the line of every edge that it is beyond; so
/// it may be within reach of a needle whose tip is farther away.
///
/// In double the same holds with e = 2^-53, coordinates relative to the mesh's own origin,
/// distances in place of the face's coordinates, and a reach of 1e-13 r + 4 e M. The tolerance is
/// 24 times the rounding, because fans turn faces into their own frame: a corner gets 3 roundings
/// there, the normal 12 by its edges, and the range 9 by products and quotients. An exact
/// back-end's answer equals the reference's to the bit, or is unexplained.
class Judge {
 public:
  /// The triangles' numbers, if they have any, must ascend. `reference` must be exact and must
  /// answer lists of rays over them. Both must outlive this.
  Judge(refine::Triangles triangles, const Intersector& reference)
      : Judge(triangles, reference, refine::bounds(triangles)) {}
  /// For some triangles of a mesh with these bounds.
  Judge(refine::Triangles triangles, const Intersector& reference, const refine::Bounds& mesh);

  Verdict judge(const Ray& ray, const Hit& expected, const Hit& found,
                Precision precision = Precision::in_float) const;

  /// Whether a tie is one of two faces that overlap in a plane, as the tops of boxes in a heap:
  /// other corners, and no edge within reach of the ray.
  bool is_overlap(const Ray& ray, const Hit& expected, const Hit& found, Precision precision) const;

  /// How far, in metres, a sound answer may be from the exact one on face number `face`.
  double tolerance_m(const Ray& ray, std::uint32_t face,
                     Precision precision = Precision::in_float) const;
  /// Whether the tolerance is more than a tenth of the face's longest edge.
  bool is_coarse(const Ray& ray, std::uint32_t face, Precision precision) const;

  /// The place of face number `face` among the triangles, or Hit::none.
  std::uint32_t index_of(std::uint32_t face) const;
  refine::Triangles triangles() const { return triangles_; }

 private:
  struct SeenFace;  // a face as a ray sees it
  SeenFace see(const Ray& ray, std::uint32_t face, Precision precision) const;
  static bool points_agree(const SeenFace& seen, const Hit& hit);
  bool surface_all_around(const SeenFace& seen, const Hit& hit) const;
  Verdict judge_same_face(const SeenFace& seen, const Hit& expected, const Hit& found) const;
  Verdict judge_passed(const SeenFace& seen, const Hit& hit) const;
  Hit ask(const Ray& ray) const;

  refine::Triangles triangles_;
  const Intersector& reference_;
  Eigen::Vector3d middle_;  // of the mesh's bounds
  double half_size_m_;      // of the bounds' longest axis
};

}  // namespace ensonify::engine
