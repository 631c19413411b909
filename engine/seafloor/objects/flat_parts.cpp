#include <ensonify/engine/seafloor/objects/flat_parts.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/objects/curved_facets.h>
#include <ensonify/engine/seafloor/objects/facets.h>

namespace ensonify::engine {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;
using std::numbers::pi;

/// Disjoint sets that can be joined (union-find). The name of a set is its lowest member.
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

/// A number for each vertex, equal for vertices at one place.
std::vector<std::uint32_t> places_of(const ObjectMesh& mesh,
                                     const std::function<void()>& stop_check) {
  const auto at = [&](std::uint32_t v) {
    const Vector3d& p = mesh.positions[v];
    return std::tuple(p.x(), p.y(), p.z());
  };
  std::vector<std::uint32_t> used;
  for (const refine::Face& face : mesh.faces) used.insert(used.end(), face.begin(), face.end());
  std::ranges::sort(used);
  used.erase(std::unique(used.begin(), used.end()), used.end());
  if (stop_check) stop_check();
  std::ranges::stable_sort(used, {}, at);
  std::vector<std::uint32_t> place(mesh.positions.size());
  for (std::size_t i = 0; i < used.size(); ++i)
    place[used[i]] = i > 0 && at(used[i]) == at(used[i - 1]) ? place[used[i - 1]]
                                                             : static_cast<std::uint32_t>(i);
  return place;
}

// From a range of at least D^2 / lambda, a rectangle has the echo of any shape of the length D. So
// pieces need not be shorter than this length, or than this share of their flat part's length.
constexpr double shortest_piece_m = 0.05, shortest_piece = 0.05;

using Corners = std::array<Vector3d, 3>;

double area_m2_of(const Corners& face) {
  return 0.5 * (face[1] - face[0]).cross(face[2] - face[0]).norm();
}

/// The second moments of a flat part about its middle / area, along two axes x and y in its plane.
struct Moments {
  Vector3d x, y;
  double xx, yy, xy;
  double root_m2() const { return std::sqrt(std::max(xx * yy - xy * xy, 0.0)); }
  /// Whether the moments are equal about all axes, as for a square.
  bool are_equal() const { return std::hypot(xx - yy, 2.0 * xy) < 1e-3 * (xx + yy); }
};

/// Sums over the faces of a flat part.
struct Sum {
  std::uint32_t faces = 0;
  double area_m2 = 0.0;
  Vector3d first = Vector3d::Zero();   // integral of the place
  Matrix3d second = Matrix3d::Zero();  // integral of place times place, about the first corner
  Vector3d origin = Vector3d::Zero();  // the first corner

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
    ++faces;
  }
  Vector3d middle() const { return origin + first / area_m2; }
  Matrix3d spread() const {
    const Vector3d off_m = first / area_m2;
    return second / area_m2 - off_m * off_m.transpose();
  }
  Moments moments(const Vector3d& normal) const {
    const Matrix3d about_middle = spread();
    const Vector3d x = normal.unitOrthogonal(), y = normal.cross(x);
    return {x, y, x.dot(about_middle * x), y.dot(about_middle * y), x.dot(about_middle * y)};
  }
  /// Whether the part has a hole or a bay, so that no rectangle or ellipse can replace it. Among
  /// convex shapes of one area, a triangle has the largest product of the moments, (A / 6 sqrt
  /// 3)^2, so a shape with a larger product is not convex.
  bool is_hollow(const Vector3d& normal) const {
    constexpr double rounding = 1.01;
    const double most_convex_m2 = area_m2 / (6.0 * std::numbers::sqrt3);
    return moments(normal).root_m2() > rounding * most_convex_m2;
  }
  FlatPart flat_part(const Vector3d& normal, std::uint32_t surface) const {
    const Matrix3d spread = this->spread();
    const Moments moments = this->moments(normal);
    const double turn = 0.5 * std::atan2(2.0 * moments.xy, moments.xx - moments.yy);
    const Vector3d along = std::cos(turn) * moments.x + std::sin(turn) * moments.y;
    const Vector3d across = normal.cross(along);
    // A rectangle of length L has a second moment of L^2 / 12 per area.
    const double shortest = 1e-12 * area_m2;
    const double ratio = std::sqrt(std::max(along.dot(spread * along), shortest) /
                                   std::max(across.dot(spread * across), shortest));
    const double length_m = std::sqrt(area_m2 * ratio), width_m = area_m2 / length_m;
    // Among shapes of one area, an ellipse has the smallest product of the moments, (A / 4 pi)^2,
    // and a rectangle has (A / 12)^2. The limit is halfway between their square roots.
    const bool round = moments.root_m2() < 0.5 * (0.25 / pi + 1.0 / 12.0) * area_m2;
    return {.middle = middle(),
            .normal = normal.cast<float>(),
            .along = along.cast<float>(),
            .across = across.cast<float>(),
            .length_m = static_cast<float>(length_m),
            .width_m = static_cast<float>(width_m),
            .round = round,
            .surface = surface};
  }
};

/// Turns the axes of a flat part whose second moments are equal and so define no axes. The new axes
/// are the sides of the smallest rectangle around the faces with a side along one of their edges.
void turn_to_sides(FlatPart& part, std::span<const Corners> faces) {
  constexpr std::size_t enough = 8;  // faces whose edges are tried
  const Vector3d normal = part.normal.cast<double>();
  double smallest_m2 = std::numeric_limits<double>::infinity();
  for (const Corners& face : faces.first(std::min(enough, faces.size())))
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d edge = face[(k + 1) % 3] - face[k];
      const Vector3d along = (edge - normal.dot(edge) * normal).normalized();
      const Vector3d across = normal.cross(along);
      Eigen::AlignedBox2d box;
      for (const Corners& its : faces)
        for (const Vector3d& corner : its)
          box.extend(Eigen::Vector2d(along.dot(corner), across.dot(corner)));
      if (!(box.volume() < (1.0 - 1e-6) * smallest_m2)) continue;
      smallest_m2 = box.volume();
      part.along = along.cast<float>();
      part.across = across.cast<float>();
    }
}

/// Adds the part of a face that is on one side of the plane through `place` with the normal `way`.
/// If `beyond`, this is the side to which `way` points, otherwise the opposite side.
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

/// Halves a hollow flat part across its longer axis until each piece fills 85 % of the rectangle
/// around it or is not longer than shortest_m.
void add_pieces(std::vector<Corners> faces, const Vector3d& normal, std::uint32_t surface,
                double shortest_m, std::vector<FlatPart>& pieces,
                const std::function<void()>& stop_check) {
  constexpr double filled = 0.85;
  if (stop_check) stop_check();
  Sum sum;
  for (const Corners& face : faces) sum.add(face, area_m2_of(face));
  if (!(sum.area_m2 > 0.0)) return;
  FlatPart piece = sum.flat_part(normal, surface);
  if (sum.moments(normal).are_equal()) turn_to_sides(piece, faces);
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
  std::uint64_t side;  // number of the side: three per face
  std::uint32_t face() const { return static_cast<std::uint32_t>(side / 3); }
};

/// The edges of all faces that have an area. Edges at one place are neighbours in the list.
std::vector<Edge> sorted_edges(const ObjectMesh& mesh, std::span<const double> areas_m2,
                               std::span<const std::uint32_t> place) {
  std::vector<Edge> edges;
  edges.reserve(3 * areas_m2.size());
  for (std::size_t f = 0; f < areas_m2.size(); ++f)
    for (std::size_t k = 0; k < 3 && areas_m2[f] > 0.0; ++k) {
      const refine::Face& face = mesh.faces[f];
      const auto [from, to] = std::minmax(place[face[k]], place[face[(k + 1) % 3]]);
      edges.push_back({from, to, 3 * f + k});
    }
  std::ranges::sort(edges, {}, [](const Edge& e) { return std::tuple(e.from, e.to, e.side); });
  return edges;
}

}  // namespace

std::vector<FlatPart> FlatParts::in_pieces() && {
  if (pieces.empty()) return std::move(whole);
  std::vector<FlatPart> all;
  for (std::size_t i = 0; i < whole.size(); ++i)
    if (const auto its = pieces.find(i); its != pieces.end())
      all.insert(all.end(), its->second.begin(), its->second.end());
    else
      all.push_back(whole[i]);
  return all;
}

FlatParts flat_parts_of(const ObjectMesh& mesh, const std::function<void()>& stop_check) {
  RareStopCheck check_stop(stop_check);
  const auto faces = static_cast<std::uint32_t>(mesh.faces.size());
  std::vector<Vector3d> normals(faces);
  std::vector<double> areas_m2(faces);
  for (std::uint32_t f = 0; f < faces; ++f) {
    check_stop();
    const Vector3d& a = mesh.corner(f, 0);
    const Vector3d product = (mesh.corner(f, 1) - a).cross(mesh.corner(f, 2) - a);
    areas_m2[f] = 0.5 * product.norm();
    if (areas_m2[f] > 0.0) normals[f] = product.normalized();
  }
  const std::vector<std::uint32_t> place = places_of(mesh, stop_check);
  if (stop_check) stop_check();
  std::vector<Edge> edges = sorted_edges(mesh, areas_m2, place);
  std::vector<BentEdge> bent;
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
      bent.push_back({mesh.faces[a.face()][a.side % 3], mesh.faces[a.face()][(a.side % 3 + 1) % 3],
                      a.face(), b.face()});
  }
  edges = {};                              // large
  std::vector<std::uint32_t> first_faces;  // the lowest face of each flat part
  std::vector<std::uint32_t> part(faces, FacesInParts::none), surface(faces);
  std::vector<Sum> sums;
  for (std::uint32_t f = 0; f < faces; ++f) {
    check_stop();
    if (!(areas_m2[f] > 0.0)) continue;
    const std::uint32_t first = flat.of(f);  // lowest face of the flat part
    if (first == f) {
      part[f] = static_cast<std::uint32_t>(sums.size());
      first_faces.push_back(f);
      sums.emplace_back();
    }
    part[f] = part[first];
    surface[f] = smooth.of(f);
    sums[part[f]].add({mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2)}, areas_m2[f]);
  }
  FlatParts flat_parts;
  flat_parts.whole.reserve(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i)
    flat_parts.whole.push_back(sums[i].flat_part(normals[first_faces[i]], surface[first_faces[i]]));
  std::vector<std::uint32_t> parts_of_surface(faces, 0);  // parts of a curved surface are not cut
  for (const FlatPart& flat_part : flat_parts.whole) ++parts_of_surface[flat_part.surface];
  const auto is_hollow = [&](std::uint32_t i) {
    return parts_of_surface[flat_parts.whole[i].surface] == 1 &&
           sums[i].is_hollow(normals[first_faces[i]]);
  };
  const auto is_square = [&](std::uint32_t i) {
    return sums[i].faces > 1 && sums[i].moments(normals[first_faces[i]]).are_equal();
  };
  std::map<std::uint32_t, std::vector<Corners>> needed;  // faces of square or hollow parts
  for (std::uint32_t i = 0; i < sums.size(); ++i)
    if (is_square(i) || is_hollow(i)) needed[i];
  for (std::uint32_t f = 0; f < faces && !needed.empty(); ++f) {
    check_stop();
    if (const auto its = needed.find(part[f]); its != needed.end())
      its->second.push_back({mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2)});
  }
  for (const auto& [i, its_faces] : needed)
    if (is_square(i)) turn_to_sides(flat_parts.whole[i], its_faces);
  flat_parts.curved =
      curved_facets({mesh, place, part, surface}, std::move(bent), flat_parts.whole, stop_check);
  for (auto& [i, its_faces] : needed) {
    if (!is_hollow(i)) continue;
    const FlatPart& whole = flat_parts.whole[i];
    add_pieces(std::move(its_faces), normals[first_faces[i]], whole.surface,
               std::max(shortest_piece_m, shortest_piece * double(whole.length_m)),
               flat_parts.pieces[i], stop_check);
  }
  return flat_parts;
}

}  // namespace ensonify::engine
