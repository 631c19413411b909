#pragma once

#include <array>
#include <cstdint>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Whether two hits are one face at one t, u and v; or both are none. (Where the face is among the
/// triangles may differ.)
bool same_bits(const Hit& a, const Hit& b);

/// What one answer is when it is compared with the reference's, from best to worst. A ray
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

/// Judges answers about rays through triangles. "Rounding" and "reach" are what arithmetic in float
/// may do to a sound answer. Let e be 2^-24, r the distance to the hit and M the largest number at
/// hand: the largest coordinate of the ray's origin about the middle of the mesh, plus that of the
/// face as seen from the ray's origin, plus half the mesh's size, in metres: the back-end's own
/// origin is at the mesh, wherever that lies.
///
/// - Float moves the ray, or the face, sideways by about e M. Edge functions carry that over the
/// face's
///   area as the ray sees it, N.d with N = (b-a)x(c-a), so the point of t, and that of u and v, are
///   off by e M L^2 / |N.d|, L being the longest edge: much on needles and on faces seen edge on.
///   The tolerance is 8 times that. Where it exceeds L, and the ray is within reach of the face's
///   plane, it lies in that plane as far as float can tell: all edge functions vanish, and rounding
///   decides whether it is met, and where.
/// - Reach, how far from the ray an edge matters, is 1e-6 r + 4 e M. A ray outside of a face is
/// within reach
///   of it if it is of every edge's line that it is beyond: of a needle's tip that is farther away.
///
/// For double the same holds with e = 2^-53, about the mesh's own origin, and a reach of 1e-13 r +
/// 4 e M. An exact back-end's answer is the reference's to the bit, or unexplained.
class Judge {
 public:
  /// The triangles' numbers, where they have any, ascend. The reference answers lists of rays over
  /// them, exactly; both must outlive this.
  Judge(refine::Triangles triangles, const Intersector& reference)
      : Judge(triangles, reference, refine::bounds(triangles)) {}
  /// Of some triangles of a mesh that has these bounds.
  Judge(refine::Triangles triangles, const Intersector& reference, const refine::Bounds& mesh);

  Verdict judge(const Ray& ray, const Hit& expected, const Hit& found,
                Precision precision = Precision::in_float) const;

  /// How far, in metres, a sound answer may lie from the exact one on the face of that number.
  double tolerance_m(const Ray& ray, std::uint32_t face,
                     Precision precision = Precision::in_float) const;
  /// Whether that is more than a tenth of the face's longest edge.
  bool is_coarse(const Ray& ray, std::uint32_t face, Precision precision) const;

  /// Where the face of that number is among the triangles; Hit::none if it is not there.
  std::uint32_t index_of(std::uint32_t face) const;
  refine::Triangles triangles() const { return triangles_; }

 private:
  struct Sight;  // a face as a ray sees it
  Sight look(const Ray& ray, std::uint32_t face, Precision precision) const;
  static bool points_agree(const Sight& sight, const Hit& hit);
  bool surface_all_around(const Sight& sight, const Hit& hit) const;
  Verdict judge_same_face(const Sight& sight, const Hit& expected, const Hit& found) const;
  Verdict judge_passed(const Sight& sight, const Hit& hit) const;
  Hit ask(const Ray& ray) const;

  refine::Triangles triangles_;
  const Intersector& reference_;
  Eigen::Vector3d middle_;  // of the mesh's bounds
  double half_size_m_;      // theirs along the longest axis
};

}  // namespace ensonify::engine
