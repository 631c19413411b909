#include <ensonify/engine/seafloor/objects/flat_parts.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include <ensonify/engine/seafloor/objects/facets.h>
#include <ensonify/engine/units.h>
#include <ensonify/engine/work_control.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;
using std::numbers::pi;

/// Sets that grow together; each is named by its lowest member.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }
  std::uint32_t of(std::uint32_t member) {
    while (parent_[member] != member) member = parent_[member] = parent_[parent_[member]];
    return member;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t one = of(a), other = of(b);
    parent_[std::max(one, other)] = std::min(one, other);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

/// A number for each vertex, the same for vertices at one place.
std::vector<std::uint32_t> places_of(refine::Triangles triangles,
                                     const std::function<void()>& stop_check) {
  const auto at = [&](std::uint32_t v) {
    const Eigen::Vector3f& p = triangles.positions[v];
    return std::tuple(p.x(), p.y(), p.z());
  };
  std::vector<std::uint32_t> used;
  for (const refine::Face& face : triangles.faces)
    used.insert(used.end(), face.begin(), face.end());
  std::ranges::sort(used);
  used.erase(std::unique(used.begin(), used.end()), used.end());
  if (stop_check) stop_check();
  std::ranges::stable_sort(used, {}, at);
  std::vector<std::uint32_t> place(triangles.positions.size());
  for (std::size_t i = 0; i < used.size(); ++i)
    place[used[i]] = i > 0 && at(used[i]) == at(used[i - 1]) ? place[used[i - 1]]
                                                             : static_cast<std::uint32_t>(i);
  return place;
}

// From a sonar at r >= D^2 / lambda a rectangle is right for any shape of the length D: pieces of a
// flat part need not be shorter than this, or than this share of it.
constexpr double shortest_piece_m = 0.05, shortest_piece = 0.05;

using Corners = std::array<Vector3d, 3>;

double area_m2_of(const Corners& face) {
  return 0.5 * (face[1] - face[0]).cross(face[2] - face[0]).norm();
}

/// The second moments per area of a flat part about its middle, along two axes in its plane.
struct Moments {
  Vector3d x, y;
  double xx, yy, xy;
  double root_m2() const { return std::sqrt(std::max(xx * yy - xy * xy, 0.0)); }
};

/// What the faces of a flat part add up to.
struct Sum {
  double area_m2 = 0.0;
  Vector3d first = Vector3d::Zero();       // integral of the place
  Matrix3d second = Matrix3d::Zero();      // integral of place times place, about the first corner
  Vector3d origin = Vector3d::Zero();      // the first corner
  Matrix3d bend = Matrix3d::Zero();        // sum over edges of length angle^2 u u, and of
  Matrix3d directions = Matrix3d::Zero();  // length u u; u: unit, in the plane, across the edge

  void add(const Corners& corners, double its_area_m2) {
    if (area_m2 == 0.0) origin = corners[0];
    Vector3d middle = Vector3d::Zero();
    for (const Vector3d& corner : corners) middle += (corner - origin) / 3.0;
    first += its_area_m2 * middle;
    second += its_area_m2 * middle * middle.transpose();
    for (const Vector3d& corner : corners) {
      const Vector3d off = corner - origin - middle;
      second += its_area_m2 / 12.0 * off * off.transpose();
    }
    area_m2 += its_area_m2;
  }
  float bend_rad(const Vector3d& axis) const {
    const double length = axis.dot(directions * axis);
    if (!(length > 1e-6 * directions.trace())) return 0.0f;
    return static_cast<float>(std::sqrt(axis.dot(bend * axis) / length));
  }
  Matrix3d spread() const {
    const Vector3d middle = first / area_m2;
    return second / area_m2 - middle * middle.transpose();
  }
  Moments moments(const Vector3d& normal) const {
    const Matrix3d about_middle = spread();
    const Vector3d x = normal.unitOrthogonal(), y = normal.cross(x);
    return {x, y, x.dot(about_middle * x), y.dot(about_middle * y), x.dot(about_middle * y)};
  }
  /// Whether it has a hole or a bay that neither a rectangle nor an ellipse can stand for. Among
  /// convex shapes of one area a triangle has the largest product of the moments, (A / 6 sqrt 3)^2:
  /// what has more is not convex. Facets of a curved surface are left as they are.
  bool is_hollow(const Vector3d& normal) const {
    constexpr double rounding = 1.01;
    const double most_convex_m2 = area_m2 / (6.0 * std::numbers::sqrt3);
    return directions.isZero(0.0) && moments(normal).root_m2() > rounding * most_convex_m2;
  }
  FlatPart flat_part(const Vector3d& normal, std::uint32_t surface) const {
    const Vector3d middle = first / area_m2;
    const Matrix3d spread = this->spread();
    const Moments moments = this->moments(normal);
    const double turn = 0.5 * std::atan2(2.0 * moments.xy, moments.xx - moments.yy);
    const Vector3d along = std::cos(turn) * moments.x + std::sin(turn) * moments.y;
    const Vector3d across = normal.cross(along);
    // A rectangle of length L has the second moment L^2 / 12.
    const double shortest = 1e-12 * area_m2;
    const double ratio = std::sqrt(std::max(along.dot(spread * along), shortest) /
                                   std::max(across.dot(spread * across), shortest));
    const double length_m = std::sqrt(area_m2 * ratio);
    // Among shapes of one area, an ellipse has the smallest product of the moments, (A / 4 pi)^2; a
    // rectangle has (A / 12)^2. The limit is halfway between them.
    const bool round = moments.root_m2() < 0.5 * (0.25 / pi + 1.0 / 12.0) * area_m2;
    return {.middle = origin + middle,
            .normal = normal.cast<float>(),
            .along = along.cast<float>(),
            .across = across.cast<float>(),
            .length_m = static_cast<float>(length_m),
            .width_m = static_cast<float>(area_m2 / length_m),
            .bend_along_rad = bend_rad(along),
            .bend_across_rad = bend_rad(across),
            .round = round,
            .piece = false,
            .surface = surface};
  }
};

/// What of a face lies on one side of the plane through `place` that is square to `way`: on that of
/// `way` or, if not `beyond`, on the other.
void add_half(const Corners& face, const Vector3d& place, const Vector3d& way, bool beyond,
              std::vector<Corners>& half) {
  const double sign = beyond ? 1.0 : -1.0;
  std::array<Vector3d, 4> polygon;
  std::size_t corners = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d &a = face[i], &b = face[(i + 1) % 3];
    const double a_m = sign * way.dot(a - place), b_m = sign * way.dot(b - place);
    if (a_m >= 0.0) polygon[corners++] = a;
    if ((a_m > 0.0 && b_m < 0.0) || (a_m < 0.0 && b_m > 0.0))
      polygon[corners++] = a + a_m / (a_m - b_m) * (b - a);
  }
  for (std::size_t i = 2; i < corners; ++i)
    if (const Corners part{polygon[0], polygon[i - 1], polygon[i]}; area_m2_of(part) > 0.0)
      half.push_back(part);
}

/// Halves a hollow flat part across its longer axis until each piece fills its rectangle or is no
/// longer than that.
void add_pieces(std::vector<Corners> faces, const Vector3d& normal, std::uint32_t surface,
                double shortest_m, std::vector<FlatPart>& pieces,
                const std::function<void()>& stop_check) {
  constexpr double filled = 0.85;
  if (stop_check) stop_check();
  Sum sum;
  for (const Corners& face : faces) sum.add(face, area_m2_of(face));
  if (!(sum.area_m2 > 0.0)) return;
  FlatPart piece = sum.flat_part(normal, surface);
  piece.round = false;
  piece.piece = true;
  const Vector3d along = piece.along.cast<double>(), across = piece.across.cast<double>();
  Eigen::AlignedBox2d box;
  for (const Corners& face : faces)
    for (const Vector3d& corner : face)
      box.extend(
          Eigen::Vector2d(along.dot(corner - piece.middle), across.dot(corner - piece.middle)));
  if (box.sizes().maxCoeff() <= shortest_m || sum.area_m2 >= filled * box.volume()) {
    pieces.push_back(piece);
    return;
  }
  std::array<std::vector<Corners>, 2> halves;
  for (const Corners& face : faces)
    for (const bool beyond : {false, true})
      add_half(face, piece.middle, along, beyond, halves[beyond ? 1 : 0]);
  faces = {};  // large
  for (std::vector<Corners>& half : halves)
    add_pieces(std::move(half), normal, surface, shortest_m, pieces, stop_check);
}

struct Edge {
  std::uint32_t from, to;
  std::uint64_t side;  // of all faces, three each
  std::uint32_t face() const { return static_cast<std::uint32_t>(side / 3); }
};

/// Where two faces meet that belong to one smooth surface, but not to one flat part.
struct Bend {
  std::array<std::uint64_t, 2> sides;  // as in Edge
  double angle_rad;
};

/// The edges of all faces that have an area; those at one place are neighbours.
std::vector<Edge> sorted_edges(refine::Triangles triangles, std::span<const double> areas_m2,
                               const std::function<void()>& stop_check) {
  const std::vector<std::uint32_t> place = places_of(triangles, stop_check);
  if (stop_check) stop_check();
  std::vector<Edge> edges;
  edges.reserve(3 * areas_m2.size());
  for (std::size_t f = 0; f < areas_m2.size(); ++f)
    for (std::size_t k = 0; k < 3 && areas_m2[f] > 0.0; ++k) {
      const refine::Face& face = triangles.faces[f];
      const auto [from, to] = std::minmax(place[face[k]], place[face[(k + 1) % 3]]);
      edges.push_back({from, to, 3 * f + k});
    }
  std::ranges::sort(edges, {}, [](const Edge& e) { return std::tuple(e.from, e.to, e.side); });
  return edges;
}

/// Flat parts, and the pieces of those that are hollow.
struct FlatParts {
  std::vector<FlatPart> whole;
  std::map<std::size_t, std::vector<FlatPart>> pieces;  // by the number in `whole`

  /// All in their order, with the pieces of a flat part in its place.
  std::vector<FlatPart> in_pieces() && {
    if (pieces.empty()) return std::move(whole);
    std::vector<FlatPart> all;
    for (std::size_t i = 0; i < whole.size(); ++i)
      if (const auto its = pieces.find(i); its != pieces.end())
        all.insert(all.end(), its->second.begin(), its->second.end());
      else
        all.push_back(whole[i]);
    return all;
  }
};

FlatParts find_flat_parts(refine::Triangles triangles, const std::function<void()>& stop_check) {
  RareStopCheck check_stop(stop_check);
  const auto faces = static_cast<std::uint32_t>(triangles.faces.size());
  std::vector<Vector3d> normals(faces);
  std::vector<double> areas_m2(faces);
  for (std::uint32_t f = 0; f < faces; ++f) {
    check_stop();
    const Vector3d a = triangles.corner(f, 0);
    const Vector3d product = (triangles.corner(f, 1) - a).cross(triangles.corner(f, 2) - a);
    areas_m2[f] = 0.5 * product.norm();
    if (areas_m2[f] > 0.0) normals[f] = product.normalized();
  }
  std::vector<Edge> edges = sorted_edges(triangles, areas_m2, stop_check);
  std::vector<Bend> bends;
  Sets flat(faces), smooth(faces);
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    check_stop();
    const Edge &a = edges[i], &b = edges[i + 1];
    if (a.from != b.from || a.to != b.to) continue;
    const Vector3d &m = normals[a.face()], &n = normals[b.face()];
    const double angle_rad = std::atan2(m.cross(n).norm(), m.dot(n));
    if (angle_rad > sharpest_rad) continue;
    smooth.join(a.face(), b.face());
    const Vector3d &first = normals[flat.of(a.face())], &second = normals[flat.of(b.face())];
    if (angle_rad < flattest_rad && first.cross(second).norm() < flattest_rad)
      flat.join(a.face(), b.face());
    else
      bends.push_back({{a.side, b.side}, angle_rad});
  }
  edges = {};                                // large
  std::vector<std::uint32_t> first_faces;    // of the flat parts
  std::vector<std::uint32_t> number(faces);  // of the flat part that begins with a face
  for (std::uint32_t f = 0; f < faces; ++f)
    if (areas_m2[f] > 0.0 && flat.of(f) == f) {
      number[f] = static_cast<std::uint32_t>(first_faces.size());
      first_faces.push_back(f);
    }
  std::vector<Sum> sums(first_faces.size());
  const auto number_of = [&](std::uint32_t face) { return number[flat.of(face)]; };
  const auto corners_of = [&](std::uint32_t f) {
    return Corners{triangles.corner(f, 0), triangles.corner(f, 1), triangles.corner(f, 2)};
  };
  for (std::uint32_t f = 0; f < faces; ++f) {
    check_stop();
    if (areas_m2[f] > 0.0) sums[number_of(f)].add(corners_of(f), areas_m2[f]);
  }
  for (const Bend& bend : bends)
    for (const std::uint64_t side : bend.sides) {
      const auto face = static_cast<std::uint32_t>(side / 3);
      const auto corner = static_cast<int>(side % 3);
      const Vector3d way =
          triangles.corner(face, (corner + 1) % 3) - triangles.corner(face, corner);
      const Vector3d across = way.cross(normals[face]);  // its length is the edge's
      const double length_m = across.norm();
      const Matrix3d direction = across * across.transpose() / length_m;
      Sum& sum = sums[number_of(face)];
      sum.directions += direction;
      sum.bend += bend.angle_rad * bend.angle_rad * direction;
    }
  FlatParts flat_parts;
  flat_parts.whole.reserve(sums.size());
  std::map<std::uint32_t, std::vector<Corners>> hollow;  // the faces of such flat parts
  for (std::uint32_t i = 0; i < sums.size(); ++i) {
    check_stop();
    const std::uint32_t face = first_faces[i];
    flat_parts.whole.push_back(sums[i].flat_part(normals[face], smooth.of(face)));
    if (sums[i].is_hollow(normals[face])) hollow[i];
  }
  for (std::uint32_t f = 0; f < faces && !hollow.empty(); ++f) {
    check_stop();
    if (!(areas_m2[f] > 0.0)) continue;
    if (const auto its = hollow.find(number_of(f)); its != hollow.end())
      its->second.push_back(corners_of(f));
  }
  for (auto& [i, its_faces] : hollow) {
    const FlatPart& whole = flat_parts.whole[i];
    add_pieces(std::move(its_faces), normals[first_faces[i]], whole.surface,
               std::max(shortest_piece_m, shortest_piece * double(whole.length_m)),
               flat_parts.pieces[i], stop_check);
  }
  return flat_parts;
}

}  // namespace

std::vector<FlatPart> flat_parts_of(refine::Triangles triangles,
                                    const std::function<void()>& stop_check) {
  return find_flat_parts(triangles, stop_check).in_pieces();
}

FlatPartBlock::FlatPartBlock(std::span<const FlatPart> flat_parts, std::size_t its_first,
                             std::size_t its_count)
    : first(its_first), count(its_count) {
  constexpr double rounding = 1e-5;  // more than that of the normals and axes
  const std::span<const FlatPart> own = flat_parts.subspan(first, count);
  for (const FlatPart& flat_part : own) {
    middle += flat_part.middle / static_cast<double>(count);
    axis += flat_part.normal.cast<double>();
  }
  axis = axis.norm() > 0.0 ? axis.normalized() : Vector3d::UnitZ();
  for (const FlatPart& flat_part : own) {
    const double half_diagonal_m =
        0.5 * std::hypot(double(flat_part.length_m), double(flat_part.width_m));
    radius_m =
        std::max(radius_m, (flat_part.middle - middle).norm() + half_diagonal_m * (1.0 + rounding));
    const double cosine = axis.dot(flat_part.normal.cast<double>().normalized());
    cone_rad = std::max(cone_rad, std::acos(std::clamp(cosine, -1.0, 1.0)) + rounding);
    max_bend_rad = std::max(max_bend_rad, std::hypot(double(flat_part.bend_along_rad),
                                                     double(flat_part.bend_across_rad)));
    if (flat_part.bend_along_rad == 0.0f)
      shortest_plane_m = std::min(shortest_plane_m, double(flat_part.length_m));
    if (flat_part.bend_across_rad == 0.0f)
      shortest_plane_m = std::min(shortest_plane_m, double(flat_part.width_m));
  }
}

bool FlatPartBlock::may_face(const Vector3d& from, double reach, bool two_sided) const {
  const Vector3d way = from - middle;
  const double distance_m = way.norm();
  if (distance_m <= radius_m || reach >= 1.0) return true;
  // Bounds without a transcendental function: asin x <= x + (pi / 2 - 1) x^3 for 0 <= x <= 1, and
  // cos x >= 1 - x^2 / 2.
  const auto max_asin = [](double x) { return x + (0.5 * pi - 1.0) * x * x * x; };
  const double angle_rad = cone_rad + max_asin(radius_m / distance_m) + max_asin(reach);
  const double facing_m = two_sided ? std::abs(axis.dot(way)) : axis.dot(way);
  return facing_m >= distance_m * (1.0 - 0.5 * angle_rad * angle_rad);
}

namespace {

/// Between which places of a line along `axis`, counted from `from`, a flat part lies, by its
/// second moments.
struct Reach {
  double low_m, high_m;
  Reach(const FlatPart& flat_part, const Vector3d& from, const Vector3d& axis) {
    const double half_m =
        0.5 * std::hypot(double(flat_part.length_m) * axis.dot(flat_part.along.cast<double>()),
                         double(flat_part.width_m) * axis.dot(flat_part.across.cast<double>()));
    const double middle_m = axis.dot(flat_part.middle - from);
    low_m = middle_m - half_m;
    high_m = middle_m + half_m;
  }
};

bool are_square(const FlatPart& a, const FlatPart& b) {
  return std::abs(a.normal.cast<double>().dot(b.normal.cast<double>())) <= std::sin(degree);
}

/// Adds the corners of two flat parts that are square to each other: on that side of each that its
/// normal shows, and on the backs.
void add_corners(const FlatPart& a, const FlatPart& b, std::vector<RightCorner>& corners) {
  constexpr double gap = 0.02;  // of the flat part, that it may lie off the edge or beyond it
  const Vector3d m = a.normal.cast<double>(), n = b.normal.cast<double>();
  const Vector3d edge = m.cross(n).normalized();
  const Vector3d in_a = edge.cross(m), in_b = n.cross(edge);  // as n and as m, nearly
  // The edge's point that is nearest to a's middle.
  const Vector3d on_edge = a.middle + in_a * (n.dot(b.middle - a.middle) / n.dot(in_a));
  const Reach along_a(a, on_edge, edge), along_b(b, on_edge, edge);
  const double from_m = std::max(along_a.low_m, along_b.low_m);
  const double until_m = std::min(along_a.high_m, along_b.high_m);
  if (!(until_m > from_m)) return;
  // How far the flat part reaches from the edge; 0 if it does not begin there.
  const auto reach_m = [&](const FlatPart& flat_part, const Vector3d& way) {
    const Reach reach(flat_part, on_edge, way);
    const double gap_m = gap * (reach.high_m - reach.low_m);
    return reach.low_m < gap_m && reach.high_m > gap_m ? reach.high_m : 0.0;
  };
  for (const double front : {1.0, -1.0})
    for (const double other_front : {1.0, -1.0}) {
      const Vector3d one = other_front * in_a, other = front * in_b;
      const double one_m = reach_m(a, one), other_m = reach_m(b, other);
      if (!(one_m > 0.0 && other_m > 0.0)) continue;
      corners.push_back({.middle = on_edge + 0.5 * (from_m + until_m) * edge,
                         .edge = edge.cast<float>(),
                         .one = one.cast<float>(),
                         .other = other.cast<float>(),
                         .length_m = static_cast<float>(until_m - from_m),
                         .one_m = static_cast<float>(one_m),
                         .other_m = static_cast<float>(other_m),
                         .excess_rad = static_cast<float>(-std::asin(one.dot(other))),
                         .open = front > 0.0 && other_front > 0.0,
                         .surface = 0});
    }
}

/// A flat part whose neighbours all stand in real edges, and a ball that holds what add_corners()
/// looks at: its rectangle and the gap around it.
struct EdgedPart {
  const FlatPart* flat_part;
  double radius_m;
  explicit EdgedPart(const FlatPart& its_flat_part)
      : flat_part(&its_flat_part),
        radius_m(0.525 *
                 std::hypot(double(its_flat_part.length_m), double(its_flat_part.width_m))) {}
  bool touches(const EdgedPart& other) const {
    const double apart_m = radius_m + other.radius_m;
    return (other.flat_part->middle - flat_part->middle).squaredNorm() <= apart_m * apart_m;
  }
};

using PartPair = std::pair<std::uint32_t, std::uint32_t>;

/// The pairs of planes that touch and are square to each other, in order. They are found by a sweep
/// along the axis over which the planes are spread the farthest.
std::vector<PartPair> square_pairs(std::span<const EdgedPart> planes,
                                   const std::function<void()>& stop_check) {
  std::vector<PartPair> pairs;
  if (planes.empty()) return pairs;
  Eigen::AlignedBox3d middles;
  for (const EdgedPart& plane : planes) middles.extend(plane.flat_part->middle);
  Eigen::Index axis = 0;
  middles.sizes().maxCoeff(&axis);
  const auto low_m = [&](std::uint32_t i) {
    return planes[i].flat_part->middle[axis] - planes[i].radius_m;
  };
  std::vector<std::uint32_t> order(planes.size());
  std::iota(order.begin(), order.end(), std::uint32_t{0});
  std::ranges::sort(order, {}, low_m);
  RareStopCheck check_stop(stop_check);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const EdgedPart& one = planes[order[i]];
    const double high_m = one.flat_part->middle[axis] + one.radius_m;
    for (std::size_t k = i + 1; k < order.size() && low_m(order[k]) <= high_m; ++k) {
      check_stop();
      const EdgedPart& other = planes[order[k]];
      if (one.touches(other) && are_square(*one.flat_part, *other.flat_part))
        pairs.emplace_back(std::minmax(order[i], order[k]));
    }
  }
  std::ranges::sort(pairs);
  return pairs;
}

}  // namespace

std::vector<RightCorner> right_corners(std::span<const FlatPart> flat_parts,
                                       const std::function<void()>& stop_check) {
  std::vector<EdgedPart> planes;
  std::uint32_t surface = 0;
  for (const FlatPart& flat_part : flat_parts) {
    surface = std::max(surface, flat_part.surface);
    if (flat_part.bend_along_rad == 0.0f && flat_part.bend_across_rad == 0.0f)
      planes.emplace_back(flat_part);
  }
  std::vector<RightCorner> corners;
  for (const auto& [one, other] : square_pairs(planes, stop_check))
    add_corners(*planes[one].flat_part, *planes[other].flat_part, corners);
  for (RightCorner& corner : corners) corner.surface = ++surface;
  return corners;
}

ObjectSurface::ObjectSurface(refine::Triangles triangles, std::uint16_t its_label,
                             const std::function<void()>& stop_check)
    : label(its_label) {
  FlatParts found = find_flat_parts(triangles, stop_check);
  corners = right_corners(found.whole, stop_check);  // a piece shows less of an edge than the whole
  flat_parts = std::move(found).in_pieces();
  const refine::Bounds box = refine::bounds(triangles);
  middle = 0.5 * (box.lowest + box.highest).cast<double>();
  radius_m = 0.5 * double((box.highest - box.lowest).norm());
  constexpr std::size_t per_block = 16;
  for (std::size_t first = 0; first < flat_parts.size(); first += per_block)
    blocks.emplace_back(flat_parts, first, std::min(per_block, flat_parts.size() - first));
}

void ObjectSurface::place_at(const Eigen::Isometry3d& place, ObjectSurface& there) const {
  there = *this;
  const Eigen::Matrix3f turn = place.linear().cast<float>();
  there.middle = place * middle;
  for (FlatPart& flat_part : there.flat_parts) {
    flat_part.middle = place * flat_part.middle;
    for (Eigen::Vector3f* axis : {&flat_part.normal, &flat_part.along, &flat_part.across})
      *axis = turn * *axis;
  }
  for (FlatPartBlock& block : there.blocks) {
    block.middle = place * block.middle;
    block.axis = place.linear() * block.axis;
  }
  for (RightCorner& corner : there.corners) {
    corner.middle = place * corner.middle;
    for (Eigen::Vector3f* axis : {&corner.edge, &corner.one, &corner.other}) *axis = turn * *axis;
  }
}

double nearest_flat_part_m(std::span<const ObjectSurface> objects, const Vector3d& from,
                           double farthest_m) {
  double nearest_m = farthest_m;
  const auto is_nearer = [&](const Vector3d& middle, double radius_m) {
    return (from - middle).norm() - radius_m < nearest_m;
  };
  for (const ObjectSurface& object : objects) {
    if (!is_nearer(object.middle, object.radius_m)) continue;
    for (const FlatPartBlock& block : object.blocks) {
      if (!is_nearer(block.middle, block.radius_m)) continue;
      for (const FlatPart& flat_part :
           std::span(object.flat_parts).subspan(block.first, block.count)) {
        const Vector3d off = from - flat_part.middle;
        const auto beyond_m = [&](const Eigen::Vector3f& axis, float length_m) {
          return std::max(std::abs(off.dot(axis.cast<double>())) - 0.5 * double(length_m), 0.0);
        };
        const Vector3d nearest(beyond_m(flat_part.along, flat_part.length_m),
                               beyond_m(flat_part.across, flat_part.width_m),
                               off.dot(flat_part.normal.cast<double>()));
        nearest_m = std::min(nearest_m, nearest.norm());
      }
    }
  }
  return nearest_m;
}

std::vector<ObjectSurface> object_surfaces(const Seafloor& seafloor, int threads,
                                           const std::function<void()>& stop_check) {
  const std::size_t count = seafloor.objects.size();
  if (count == 0 || seafloor.one_label()) return {};
  struct Part {
    std::uint32_t face;  // the number
    refine::Face corners;
  };
  std::vector<std::vector<Part>> parts(seafloor.labels.size());
  const auto take = [&](std::uint32_t face, const auto& corners_of) {
    const std::uint16_t label = seafloor.label_of(face);
    const std::size_t number = std::size_t{seafloor.labels[label].instance} - 1;
    if (number >= count) return;
    parts[label].push_back({face, corners_of()});
  };
  std::span<const Eigen::Vector3f> positions = seafloor.mesh.positions;
  if (const refine::ProgressiveMesh* mesh = seafloor.progressive.get()) {
    positions = mesh->points;
    for (std::size_t slot = 0; slot < mesh->faces.size(); ++slot) {
      const std::uint32_t face = mesh->source_face[slot];
      if (face < seafloor.bed_faces || face >= seafloor.faces) continue;
      take(face, [&] {
        if (slot / 2 < mesh->mid.size()) mesh->verify_node(static_cast<std::uint32_t>(slot / 2));
        const refine::Face corners = mesh->faces[slot];
        for (const std::uint32_t leaf : corners) mesh->verify_leaf(leaf);
        return corners;
      });
    }
  } else {
    const std::uint32_t first = seafloor.first_in_mesh();
    for (std::size_t i = seafloor.bed_faces - first; i < seafloor.mesh.faces.size(); ++i)
      take(first + static_cast<std::uint32_t>(i), [&] { return seafloor.mesh.faces[i]; });
  }
  std::vector<std::uint16_t> labels;  // of objects
  for (std::size_t label = 0; label < parts.size(); ++label)
    if (!parts[label].empty()) labels.push_back(static_cast<std::uint16_t>(label));
  std::vector<std::optional<ObjectSurface>> made(labels.size());
  refine::parallel_for(labels.size(), threads, [&](std::size_t i, int) {
    if (stop_check) stop_check();
    std::vector<Part>& of_object = parts[labels[i]];
    std::ranges::sort(of_object, {}, &Part::face);
    refine::TriangleMesh own;
    for (const Part& part : of_object) {
      const auto first = static_cast<std::uint32_t>(own.positions.size());
      for (const std::uint32_t corner : part.corners) own.positions.push_back(positions[corner]);
      own.faces.push_back({first, first + 1, first + 2});
    }
    made[i].emplace(own, labels[i], stop_check);
  });
  std::vector<ObjectSurface> objects;
  for (std::optional<ObjectSurface>& surface : made) objects.push_back(std::move(*surface));
  return objects;
}

}  // namespace ensonify::engine
