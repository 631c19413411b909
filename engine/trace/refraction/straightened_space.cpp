#include <ensonify/engine/trace/refraction/straightened_space.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/engine/trace/fan_scan/fan_scan.h>

namespace ensonify::engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t most_parts_of_fan = 3'000'000;  // of its faces: some 300 MB

/// A fan's beam as a wedge about its broadside plane, to test boxes: for flat boxes a tighter test
/// than that of the balls around them.
struct Wedge {
  Vector3f apex, axis, abs_axis;
  float sine, range_m, margin_m;
  explicit Wedge(const refine::FanVolume& volume)
      : apex(volume.apex.cast<float>()),
        axis(volume.array_axis.cast<float>()),
        abs_axis(axis.cwiseAbs()),
        sine(static_cast<float>(std::sin(volume.truncation_rad)) + 1e-5f),
        range_m(static_cast<float>(volume.range_m)),
        // More than those of ViewTest, with the rounding of this test.
        margin_m(static_cast<float>(volume.margin_m + 1e-2 + 1e-5 * volume.range_m +
                                    1e-6 * volume.apex.lpNorm<Eigen::Infinity>())) {}
  bool touches(const Vector3f& middle, const Vector3f& half) const {
    const Vector3f away = middle - apex;
    const float distance = away.norm(), radius = half.norm();
    return distance <= range_m + radius + margin_m &&
           std::abs(axis.dot(away)) <= abs_axis.dot(half) + sine * (distance + radius) + margin_m;
  }
};

}  // namespace

StraightenedSpace::StraightenedSpace(Straightening& straightening, double tolerance_m)
    : straightening_(&straightening),
      most_bow8_m2_(Straightening::most_bow8_m2(tolerance_m)),
      scan_(make_fan_scan({})) {}

void StraightenedSpace::group_faces() {
  const auto take = [](auto& groups, const Vector3f& low, const Vector3f& high) {
    groups.push_back({0.5f * (low + high), 0.5f * (high - low) * 1.0001f});
  };
  groups_.clear();
  larger_.clear();
  const Vector3f far = Vector3f::Constant(std::numeric_limits<float>::infinity());
  Vector3f all_low = far, all_high = -far;
  for (std::size_t first = 0; first < triangles_.faces.size(); first += group_size) {
    Vector3f low = far, high = -far;
    const std::size_t end = std::min(first + group_size, triangles_.faces.size());
    for (std::size_t face = first; face < end; ++face)
      for (const std::uint32_t corner : triangles_.faces[face]) {
        low = low.cwiseMin(triangles_.positions[corner]);
        high = high.cwiseMax(triangles_.positions[corner]);
      }
    take(groups_, low, high);
    all_low = all_low.cwiseMin(low);
    all_high = all_high.cwiseMax(high);
    if (groups_.size() % groups_together == 0 || end == triangles_.faces.size()) {
      take(larger_, all_low, all_high);
      all_low = far, all_high = -far;
    }
  }
}

/// Collects the faces that the fan can touch. The choice depends on each face and the fan alone,
/// because some of the chosen faces decide how rays are traced. All face sources give the faces
/// that the fan can touch; they differ in the other faces that they give. The tests of groups and
/// boxes, which are faster, leave out none of the faces that the fan can touch.
void StraightenedSpace::collect_faces() {
  collected_.clear();
  const refine::FanVolume volume = fan_volume_of(*fan_);
  const Wedge wedge(volume);
  view_.look_at({&volume, 1});
  const auto touches = [&](const Group& group) {
    return wedge.touches(group.middle, group.half) &&
           view_.touches({group.middle, group.half.norm()});
  };
  for (std::size_t i = 0; i < larger_.size(); ++i) {
    if (!touches(larger_[i])) continue;
    const std::size_t end = std::min((i + 1) * groups_together, groups_.size());
    for (std::size_t k = i * groups_together; k < end; ++k) {
      if (!touches(groups_[k])) continue;
      const std::size_t last = std::min((k + 1) * group_size, triangles_.faces.size());
      for (std::size_t face = k * group_size; face < last; ++face) {
        const auto& [a, b, c] = triangles_.faces[face];
        const Vector3f &p = triangles_.positions[a], &q = triangles_.positions[b],
                       &r = triangles_.positions[c];
        const Vector3f low = p.cwiseMin(q).cwiseMin(r), high = p.cwiseMax(q).cwiseMax(r);
        if (wedge.touches(0.5f * (low + high), 0.5001f * (high - low)) && view_.touches({p, q, r}))
          collected_.push_back(static_cast<std::uint32_t>(face));
      }
    }
  }
}

/// Adds a point of the sea; returns its number. Its ray does not depend on points added before.
std::uint32_t StraightenedSpace::add_point(const Vector3d& point) {
  points_.push_back(point);
  stands_high_ =
      !straightening_->move(point, rays_.emplace_back(), mesh_.positions.emplace_back()) ||
      stands_high_;
  return static_cast<std::uint32_t>(points_.size() - 1);
}

/// The point of a vertex, added if it is not there yet.
std::uint32_t StraightenedSpace::point_of(std::uint32_t vertex) {
  const std::size_t mask = point_slots_.size() - 1;
  const int shift = 32 - std::countr_zero(point_slots_.size());
  for (std::size_t slot = (vertex * 2654435769u) >> shift;; slot = (slot + 1) & mask) {
    auto& [number, place] = point_slots_[slot];
    if (number == vertex) return place;
    if (number != none) continue;
    number = vertex;
    return place = add_point(triangles_.positions[vertex].cast<double>());
  }
}

/// Adds a face, cut along its edges until all of them are straight enough. Faces that share an edge
/// cut it at the same points. Returns false for more parts of faces than fit.
bool StraightenedSpace::add_face(const refine::Face& whole, std::uint32_t place) {
  const auto bows = [&](const Straightening::RayToPoint& a, const Straightening::RayToPoint& b,
                        const Vector3d& edge) {
    return a.cotangent != inf && b.cotangent != inf &&
           Straightening::bow8_m2(a, b, edge.cast<float>()) > most_bow8_m2_;
  };
  open_.assign(1, whole);
  while (!open_.empty()) {
    const refine::Face face = open_.back();
    open_.pop_back();
    std::size_t longest = 0;
    double longest_m2 = 0.0, most = 0.0, least = inf;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = face[k], to = face[(k + 1) % 3];
      const Vector3d edge = points_[to] - points_[from];
      const double length_m2 = edge.squaredNorm();
      if (length_m2 > longest_m2 &&
          (length_m2 > Straightening::longest_edge_m * Straightening::longest_edge_m ||
           bows(rays_[from], rays_[to], edge))) {
        longest_m2 = length_m2;
        longest = k;
      }
      most = std::max(most, rays_[from].cotangent);
      least = std::min(least, rays_[from].cotangent);
    }
    if (longest_m2 > 0.0) {
      const std::uint32_t a = face[longest], b = face[(longest + 1) % 3],
                          c = face[(longest + 2) % 3];
      const std::uint32_t middle = add_point(0.5 * (points_[a] + points_[b]));
      open_.push_back({a, middle, c});
      open_.push_back({middle, b, c});
    } else if (++parts_ > most_parts_of_fan) {
      return false;
    } else if (most == inf) {  // part of it no known ray reaches: the rays towards it are undecided
      flattest_ = std::min(flattest_, least);
    } else {
      mesh_.faces.push_back(face);
      face_place_.push_back(place);
      face_number_.push_back(triangles_.number(place));
    }
  }
  return true;
}

/// Straightens the collected faces. Returns false if one of them stands too high or is too large.
bool StraightenedSpace::straighten_faces() {
  point_slots_.assign(std::bit_ceil(4 * collected_.size() + 16), {none, none});
  points_.clear();
  rays_.clear();
  mesh_.positions.clear();
  mesh_.faces.clear();
  face_place_.clear();
  face_number_.clear();
  parts_ = 0;
  stands_high_ = false;
  straightening_->start(*fan_);
  flattest_ = straightening_->flattest();
  for (const std::uint32_t place : collected_) {
    refine::Face face;
    for (std::size_t k = 0; k < 3; ++k) face[k] = point_of(triangles_.faces[place][k]);
    if (stands_high_ || !add_face(face, place)) return false;
  }
  return true;
}

bool StraightenedSpace::trace(const RayFan& fan, const Faces& faces, std::span<Hit> hits,
                              std::vector<std::uint32_t>& undecided) {
  constexpr double right_angle = 0.5 * std::numbers::pi;  // as far as a scan sees
  if (fan.grid->elevation_rad.front() < -right_angle ||
      fan.grid->elevation_rad.back() > right_angle)
    return false;
  fan_ = &fan;
  triangles_ = faces.triangles;
  if (grouped_version_ != faces.version) {
    group_faces();
    grouped_version_ = faces.version;
  }
  collect_faces();
  if (!straighten_faces()) return false;
  RayFan straight = fan;
  straight.origin.setZero();
  scan_->build({mesh_.positions, mesh_.faces, face_number_});
  if (scan_->list_runs(straight, runs_))
    runs_.give_hits(straight, hits);
  else
    scan_->intersect(straight, hits);

  undecided.clear();
  hit_piece_.resize(hits.size());
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    const Vector3d in_plane = fan.plane_direction(plane);
    for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation) {
      const std::size_t number = plane * fan.elevations() + elevation;
      Hit& hit = hits[number];
      const Vector3d direction = fan.direction(in_plane, elevation);
      const double level2 = direction.head<2>().squaredNorm(), down = -direction.z();
      if (down > 0.0 && level2 < flattest_ * flattest_ * down * down) {
        if (!hit) continue;
        hit_piece_[number] = hit.index;
        hit.index = face_place_[hit.index];
      } else {
        hit = Hit{};
        if (fan.grid->within_beam(plane, elevation) &&
            straightening_->may_hit(std::sqrt(level2), down))
          undecided.push_back(static_cast<std::uint32_t>(number));
      }
    }
  }
  return true;
}

RayIncidence StraightenedSpace::incidence_of(std::size_t number, Hit& hit) {
  const refine::Face& piece = mesh_.faces[hit_piece_[number]];
  Straightening::Piece corners;
  for (std::size_t k = 0; k < 3; ++k) {
    corners.in_sea[k] = points_[piece[k]];
    corners.straightened[k] = mesh_.positions[piece[k]];
  }
  return straightening_->incidence(number, corners, hit);
}

}  // namespace ensonify::engine
