#include <ensonify/engine/trace/check/judge.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Geometry>

namespace ensonify::engine {

using Eigen::Vector3d;

namespace {

struct Arithmetic {
  double rounding;           // e
  double steps;              // roundings in the computation of one answer
  double edge_reach;         // relative to the range
  double barycentric_slack;  // of u and v
};
constexpr Arithmetic arithmetic_of(Precision precision) {
  return precision == Precision::in_float ? Arithmetic{0x1p-24, 8.0, 1e-6, 1e-5}
                                          : Arithmetic{0x1p-53, 24.0, 1e-13, 1e-12};
}

double distance_to_segment(const Vector3d& p, const Vector3d& q) {
  const double length2 = (q - p).squaredNorm();
  const double along = length2 > 0.0 ? std::clamp(-p.dot(q - p) / length2, 0.0, 1.0) : 0.0;
  return (p + along * (q - p)).norm();
}

/// From the origin to the nearest edge of a triangle.
double distance_to_edges(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return std::min(
      {distance_to_segment(a, b), distance_to_segment(b, c), distance_to_segment(c, a)});
}

double largest(const Vector3d& v) { return v.cwiseAbs().maxCoeff(); }

}  // namespace

bool same_bits(const Hit& a, const Hit& b) {
  return a.face == b.face && (!a || (a.t == b.t && a.u == b.u && a.v == b.v));
}

Judge::Judge(refine::Triangles triangles, const Intersector& reference, const refine::Bounds& mesh)
    : triangles_(triangles),
      reference_(reference),
      middle_(0.5 * (mesh.lowest.cast<double>() + mesh.highest.cast<double>())),
      half_size_m_(largest(mesh.highest.cast<double>() - middle_)) {}

/// A face as a ray sees it. Corners are relative to the ray's origin; `across` is their part across
/// the ray.
struct Judge::SeenFace {
  const Ray& ray;
  Precision precision;
  Arithmetic by;
  std::array<Vector3d, 3> corners, across;
  double length;  // of the direction
  double longest_edge_m;
  double largest_m;  // M
  double min_height_m;
  double rounding_m;  // of t, u and v; infinite if exactly edge on
  double edge_m;      // from the ray's line to the nearest edge
  double outside_m;   // how far the ray's line is beyond an edge's line, at most; <= 0 inside
  double plane_m;     // from the ray, beside a corner, to the face's plane
  bool inside;        // the line goes through the face, by plain arithmetic

  double metres(double t) const { return t * length; }
  bool coplanar(const Hit& hit) const {
    return rounding_m > longest_edge_m && plane_m <= reach_m(hit.t);
  }
  double tolerance_m() const { return std::min(rounding_m, longest_edge_m); }
  /// The rounding of u and v in double; for float, barycentric_slack is enough (tried).
  double rounding_of_weights() const {
    return precision == Precision::in_float ? 0.0 : std::min(rounding_m / min_height_m, 1e-6);
  }
  double reach_m(double t) const {
    return by.edge_reach * metres(t) + 4.0 * by.rounding * largest_m;
  }
  /// Where two edges meet at a sharp corner, the ray may be near both and still far from the
  /// corner.
  bool passes_edge(const Hit& hit) const { return (inside ? edge_m : outside_m) <= reach_m(hit.t); }
  bool is_amid(const Hit& hit) const { return inside && edge_m > reach_m(hit.t); }
  bool meets_end(const Hit& hit) const {
    return metres(std::abs(hit.t - ray.t_min)) <= rounding_m ||
           metres(std::abs(hit.t - ray.t_max)) <= rounding_m;
  }
  /// The reason that rounding gives for a hit of one answer that the other does not have.
  Verdict explanation(const Hit& hit) const {
    if (coplanar(hit)) return Verdict::coplanar;
    if (meets_end(hit)) return Verdict::end;
    return passes_edge(hit) ? Verdict::edge : Verdict::unexplained;
  }
};

Judge::SeenFace Judge::see(const Ray& ray, std::uint32_t face, Precision precision) const {
  const std::uint32_t index = index_of(face);
  SeenFace s{.ray = ray,
             .precision = precision,
             .by = arithmetic_of(precision),
             .length = ray.direction.stableNorm()};
  const Vector3d unit = ray.direction / s.length;
  double from_origin = 0.0;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    s.corners[i] = triangles_.corner(index, k) - ray.origin;
    s.across[i] = s.corners[i] - s.corners[i].dot(unit) * unit;
    // A fan's frame may have any direction, so that a coordinate is at most the distance.
    from_origin = std::max(from_origin, precision == Precision::in_float ? largest(s.corners[i])
                                                                         : s.corners[i].norm());
  }
  const auto& [a, b, c] = s.corners;
  const double longest2 =
      std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  s.longest_edge_m = std::sqrt(longest2);
  // Double is precise enough anywhere; float needs an origin near the mesh.
  const Vector3d home = precision == Precision::in_float ? middle_ : Vector3d::Zero();
  s.largest_m = largest(ray.origin - home) + from_origin;
  if (precision == Precision::in_float) s.largest_m += half_size_m_;
  const Vector3d normal = (b - a).cross(c - a);
  s.min_height_m = normal.norm() / s.longest_edge_m;
  s.plane_m = std::min({std::abs(normal.dot(s.across[0])), std::abs(normal.dot(s.across[1])),
                        std::abs(normal.dot(s.across[2]))}) /
              normal.norm();
  s.rounding_m = s.by.steps * s.by.rounding * s.largest_m * longest2 / std::abs(normal.dot(unit));
  s.edge_m = distance_to_edges(s.across[0], s.across[1], s.across[2]);
  // Of the parts across the ray: products of whole corners would lose e r^2 of a face that is far.
  const auto side = [&](std::size_t from, std::size_t to) {
    return unit.dot(s.across[from].cross(s.across[to]));
  };
  const double ab = side(0, 1), bc = side(1, 2), ca = side(2, 0);
  s.inside = (ab > 0.0 && bc > 0.0 && ca > 0.0) || (ab < 0.0 && bc < 0.0 && ca < 0.0);
  const double turn = ab + bc + ca > 0.0 ? 1.0 : -1.0;
  const auto beyond_m = [&](double of_edge, const Vector3d& p, const Vector3d& q) {
    return (q - p).isZero(0.0) ? p.norm() : -turn * of_edge / (q - p).norm();
  };
  s.outside_m =
      std::max({beyond_m(ab, s.across[0], s.across[1]), beyond_m(bc, s.across[1], s.across[2]),
                beyond_m(ca, s.across[2], s.across[0])});
  return s;
}

bool Judge::is_overlap(const Ray& ray, const Hit& expected, const Hit& found,
                       Precision precision) const {
  const SeenFace one = see(ray, expected.face, precision), other = see(ray, found.face, precision);
  const bool same_corners = std::ranges::is_permutation(one.corners, other.corners);
  return !same_corners && one.is_amid(expected) && other.is_amid(found);
}

double Judge::tolerance_m(const Ray& ray, std::uint32_t face, Precision precision) const {
  return see(ray, face, precision).tolerance_m();
}

bool Judge::is_coarse(const Ray& ray, std::uint32_t face, Precision precision) const {
  const SeenFace seen = see(ray, face, precision);
  return seen.rounding_m > 0.1 * seen.longest_edge_m;
}

std::uint32_t Judge::index_of(std::uint32_t face) const {
  if (triangles_.numbers.empty()) return face < triangles_.faces.size() ? face : Hit::none;
  const auto at = std::ranges::lower_bound(triangles_.numbers, face);
  return at != triangles_.numbers.end() && *at == face
             ? static_cast<std::uint32_t>(at - triangles_.numbers.begin())
             : Hit::none;
}

/// Whether t, u and v give the same point, on the face and within the ray's ends.
bool Judge::points_agree(const SeenFace& seen, const Hit& hit) {
  const double slack = seen.by.barycentric_slack + seen.rounding_of_weights();
  if (!(hit.t >= seen.ray.t_min && hit.t <= seen.ray.t_max)) return false;
  if (!(hit.u >= -slack && hit.v >= -slack && hit.u + hit.v <= 1.0 + slack)) return false;
  if (seen.coplanar(hit)) return true;
  const auto& [a, b, c] = seen.corners;
  const Vector3d on_face = a + hit.u * (b - a) + hit.v * (c - a);
  return (on_face - hit.t * seen.ray.direction).norm() <= seen.tolerance_m();
}

Hit Judge::ask(const Ray& ray) const {
  Hit hit;
  reference_.intersect({&ray, 1}, {&hit, 1});
  return hit;
}

/// Whether rays moved slightly to eight sides all meet faces that join where this ray passes.
bool Judge::surface_all_around(const SeenFace& seen, const Hit& hit) const {
  const Vector3d unit = seen.ray.direction / seen.length;
  const Vector3d right = unit.unitOrthogonal(), up = unit.cross(right);
  const double range_m = seen.metres(hit.t), away_m = 2.0 * seen.reach_m(hit.t);
  for (int i = 0; i < 8; ++i) {
    const double turn = i * std::numbers::pi / 4.0;
    const Vector3d nudge = away_m * (std::cos(turn) * right + std::sin(turn) * up);
    const Hit around =
        ask({seen.ray.origin + nudge, unit, std::max(0.0, range_m - seen.longest_edge_m)});
    if (!around) return false;
    const SeenFace other = see(seen.ray, around.face, seen.precision);
    if (around.t > range_m + seen.longest_edge_m + other.longest_edge_m) return false;
    if (around.face == hit.face) continue;
    if (other.edge_m > 2.0 * away_m) return false;
    // It joins this face only if it is near the place of this hit. An edge that the ray passes far
    // behind a ridge, where both lie in a plane of the grid, does not count.
    const Vector3d at = range_m * unit;
    const auto& [a, b, c] = other.corners;
    const double apart_m = distance_to_edges(a - at, b - at, c - at);
    if (apart_m > 2.0 * away_m + 0.01 * other.longest_edge_m) return false;
  }
  return true;
}

/// The verdict for a ray that passed a face which the reference hits.
Verdict Judge::judge_passed(const SeenFace& seen, const Hit& hit) const {
  const Verdict explanation = seen.explanation(hit);
  return explanation == Verdict::edge && surface_all_around(seen, hit) ? Verdict::leak
                                                                       : explanation;
}

Verdict Judge::judge_same_face(const SeenFace& seen, const Hit& expected, const Hit& found) const {
  if (!points_agree(seen, found)) return Verdict::unexplained;
  const double apart_m = seen.metres(std::abs(found.t - expected.t));
  if (apart_m <= seen.tolerance_m()) return Verdict::same;
  return seen.coplanar(found) ? Verdict::coplanar : Verdict::unexplained;
}

Verdict Judge::judge(const Ray& ray, const Hit& expected, const Hit& found,
                     Precision precision) const {
  if (!expected && !found) return Verdict::same;
  if (precision == Precision::exact)
    return same_bits(expected, found) ? Verdict::same : Verdict::unexplained;
  if (found && index_of(found.face) == Hit::none) return Verdict::unexplained;
  const std::optional<SeenFace> there =
      found ? std::optional(see(ray, found.face, precision)) : std::nullopt;
  if (there && expected.face == found.face) return judge_same_face(*there, expected, found);
  if (there && !(points_agree(*there, found) &&
                 (there->inside || there->passes_edge(found) || there->coplanar(found))))
    return Verdict::unexplained;

  // Every face that the reference meets before the found hit must be explained by rounding.
  Verdict worst = Verdict::tie;
  Ray rest = ray;
  for (Hit met = expected; met; met = rest.t_min <= rest.t_max ? ask(rest) : Hit{}) {
    const SeenFace seen = see(ray, met.face, precision);
    if (there) {
      const double ahead_m = seen.metres(found.t - met.t);
      const double near_m = seen.tolerance_m() + there->tolerance_m();
      if (std::abs(ahead_m) <= near_m)
        return there->coplanar(found) ? std::max(worst, Verdict::coplanar) : worst;
      if (ahead_m < 0.0) break;
    }
    worst = std::max(worst, judge_passed(seen, met));
    if (worst == Verdict::unexplained) return worst;
    rest.t_min = met.t + std::max(seen.tolerance_m() / seen.length, 1e-15 * met.t);
  }
  if (!there) return worst;
  // The reference does not hit the found face.
  return std::max(worst, there->explanation(found));
}

}  // namespace ensonify::engine
