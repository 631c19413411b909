#include <ensonify/engine/trace/exact/pluecker_faces.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/trace/exact/exact_side.h>
#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {
namespace {

constexpr double roundoff = 0x1p-53;
constexpr double shortest_direction = 0x1p-100;

int doublings_of(const Ray& ray) {
  check_ray(ray);
  const double largest = ray.direction.lpNorm<Eigen::Infinity>();
  return largest < shortest_direction ? -std::ilogb(largest) : 0;
}

/// x >= 0 rounded up, and never zero.
float above(double x) {
  return std::nextafter(static_cast<float>(x), std::numeric_limits<float>::infinity());
}

}  // namespace

// Scaling the direction by a power of two is exact. The limit may be off by half the smallest
// denormal; 2^-1000 covers that.
PlueckerQuery::PlueckerQuery(const Ray& ray)
    : doublings_(doublings_of(ray)),
      origin_(ray.origin),
      direction_(ray.direction.unaryExpr([&](double x) { return std::ldexp(x, doublings_); })),
      moment_(origin_.cross(direction_)),
      largest_origin_(origin_.lpNorm<Eigen::Infinity>()),
      largest_direction_(direction_.lpNorm<Eigen::Infinity>()),
      line_(origin_, direction_),
      t_min_(ray.t_min),
      t_max_(std::min(ray.t_max, std::numeric_limits<double>::max())),
      limit_(std::ldexp(t_max_, -doublings_) + 0x1p-1000) {}

void PlueckerFaces::build(refine::Triangles triangles, const std::function<void()>& stop_check) {
  RareStopCheck check_stop(stop_check);
  check_vertices(triangles);
  constexpr std::size_t most = (std::size_t{1} << 31) / 3;
  if (triangles.faces.size() > most)
    throw refine::MeshError(
        fmt::format("{} faces are too many for the Plücker test, which numbers their edges up to "
                    "2^31; use embree",
                    triangles.faces.size()));
  struct HalfEdge {
    std::uint32_t from, to, face, corner;
  };
  std::vector<HalfEdge> half_edges;
  half_edges.reserve(3 * triangles.faces.size());
  for (std::uint32_t face = 0; face < triangles.faces.size(); ++face) {
    check_stop();
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto [from, to] =
          std::minmax({triangles.faces[face][k], triangles.faces[face][(k + 1) % 3]});
      half_edges.push_back({from, to, face, k});
    }
  }
  std::sort(half_edges.begin(), half_edges.end(), [&](const HalfEdge& a, const HalfEdge& b) {
    check_stop();
    return std::pair(a.from, a.to) < std::pair(b.from, b.to);
  });
  triangles_ = triangles;
  faces_.resize(triangles.faces.size());
  const auto begins_edge = [&](std::size_t i) {
    return i == 0 || half_edges[i - 1].from != half_edges[i].from ||
           half_edges[i - 1].to != half_edges[i].to;
  };
  std::size_t edges = 0;
  for (std::size_t i = 0; i < half_edges.size(); ++i) edges += begins_edge(i);
  edges_.clear();
  edges_.reserve(edges);
  for (std::size_t i = 0; i < half_edges.size(); ++i) {
    check_stop();
    const HalfEdge& half = half_edges[i];
    if (begins_edge(i)) edges_.push_back(edge_between(half.from, half.to));
    const auto edge = static_cast<std::uint32_t>(edges_.size() - 1);
    const bool against = triangles.faces[half.face][half.corner] != edges_.back().from;
    faces_[half.face][half.corner] = 2 * edge + against;
  }
}

PlueckerFaces::Edge PlueckerFaces::edge_between(std::uint32_t from, std::uint32_t to) const {
  const auto place = [&](std::uint32_t vertex) {
    const Eigen::Vector3f& at = triangles_.positions[vertex];
    return std::tuple(at.x(), at.y(), at.z());
  };
  if (place(to) < place(from)) std::swap(from, to);
  const Eigen::Vector3d p = triangles_.positions[from].cast<double>();
  const Eigen::Vector3d along = triangles_.positions[to].cast<double>() - p;
  return {along,
          p.cross(along),
          from,
          to,
          above(20.0 * roundoff * along.lpNorm<1>()),
          above(p.lpNorm<Eigen::Infinity>())};
}

Box PlueckerFaces::box(std::uint32_t face) const {
  Box box = no_box;
  for (const std::uint32_t vertex : triangles_.faces[face]) box.take(triangles_.positions[vertex]);
  return box;
}

// With u = 2^-53, l = along, p = from and the ray's o and d: the relative error of a component of
// the stored l is within u. The error of a component of the edge's moment is 3u (|p_j l_k| + |p_k
// l_j|) (l, product, difference), and of the ray's moment 2u (|o_j d_k| + |o_k d_j|). A product of
// the sum below adds 1u (and l's 1u), the sum of six products 5u: 9u each. With the largest
// components O, D, P of o, d, p
//   error <= 9u (1 + 9u) sum_i |d_i| (|p_j l_k| + |p_k l_j|) + |l_i| (|o_j d_k| + |o_k d_j|)
//         <= 18.1u D (P + O) (|l_x| + |l_y| + |l_z|).
// 20u instead also covers the bound's own rounding. slack and reach are at least the smallest float
// and D at least 2^-100, so the bound is above 2^-400. That covers products that underflow (each
// off by 2^-1075, times at most 2^62).
PlueckerFaces::Side PlueckerFaces::side(const PlueckerQuery& query, std::uint32_t half_edge) const {
  const Edge& edge = edges_[half_edge / 2];
  const double product = query.direction_.dot(edge.moment) + query.moment_.dot(edge.along);
  const double bound = query.largest_direction_ * edge.slack * (edge.reach + query.largest_origin_);
  int sign = (product > bound) - (product < -bound);
  if (sign == 0) [[unlikely]]
    sign = exact_side(query.origin_, query.direction_, triangles_.positions[edge.from],
                      triangles_.positions[edge.to]);
  return half_edge % 2 ? Side{-product, -sign} : Side{product, sign};
}

void PlueckerFaces::meet(PlueckerQuery& query, std::uint32_t face) const {
  const auto& half_edges = faces_[face];
  const Side first = side(query, half_edges[0]);
  if (first.sign == 0) return;
  const Side second = side(query, half_edges[1]);
  if (second.sign != first.sign) return;
  const Side third = side(query, half_edges[2]);
  if (third.sign == first.sign) take(query, face, {first, second, third});
}

void PlueckerFaces::take(PlueckerQuery& query, std::uint32_t face,
                         const std::array<Side, 3>& sides) const {
  const BoxLine::Cut cut = query.line_.cut(box(face));
  if (!cut.ahead()) return;
  const Eigen::Vector3d a = triangles_.corner(face, 0);
  const Eigen::Vector3d normal =
      (triangles_.corner(face, 1) - a).cross(triangles_.corner(face, 2) - a);
  const double in_plane = normal.dot(a - query.origin_) / normal.dot(query.direction_);
  // The hit is kept within the face's box, whatever rounding does to a face seen almost edge on
  // (where in_plane may even be NaN): so a tree of boxes cannot lose it.
  const double scaled = std::min(std::max(cut.enter, in_plane), cut.leave);
  const double t = std::ldexp(scaled, query.doublings_);
  if (!(scaled >= 0.0 && t >= query.t_min_ && t <= query.t_max_)) return;
  if (scaled > query.limit_) return;
  const std::uint32_t number = triangles_.number(face);
  if (scaled == query.limit_ &&
      std::pair(number, face) > std::pair(query.nearest_.face, query.nearest_.index))
    return;
  // The products are the corners' weights. A product whose sign was decided exactly may be pure
  // rounding, with the wrong sign.
  const auto weight = [&](const Side& side) { return std::max(0.0, side.sign * side.product); };
  const double sum = weight(sides[0]) + weight(sides[1]) + weight(sides[2]);
  query.nearest_ = {number, face, t, sum > 0.0 ? weight(sides[2]) / sum : 0.0,
                    sum > 0.0 ? weight(sides[0]) / sum : 0.0};
  query.limit_ = scaled;
}

}  // namespace ensonify::engine
