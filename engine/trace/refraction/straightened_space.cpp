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

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using scatter::SoundSpeedLayer;
using scatter::SoundSpeedProfile;

constexpr double longest_edge_m = 2.0;  // of the faces in straightened space
constexpr double clearance_m = 0.1;     // all faces lie at least so far below the sonar
constexpr double inf = std::numeric_limits<double>::infinity();
constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
constexpr double min_spreading = 0.01;  // as a share of the path squared, as in SoundRay

/// The fastest speed between two depths.
double fastest_mps(const SoundSpeedProfile& profile, double from_m, double to_m) {
  double fastest = std::max(profile.speed_mps(from_m), profile.speed_mps(to_m));
  for (const SoundSpeedLayer& layer : profile.layers())
    if (layer.top_m > from_m && layer.top_m < to_m) fastest = std::max(fastest, layer.top_mps);
  return fastest;
}

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
        margin_m(static_cast<float>(volume.margin_m) + 1e-2f) {}
  bool touches(const Vector3f& middle, const Vector3f& half) const {
    const Vector3f away = middle - apex;
    const float distance = away.norm(), radius = half.norm();
    return distance <= range_m + radius + margin_m &&
           std::abs(axis.dot(away)) <= abs_axis.dot(half) + sine * (distance + radius) + margin_m;
  }
};

}  // namespace

StraightenedSpace::StraightenedSpace(const SoundSpeedProfile& profile, double shallowest_m,
                                     double deepest_m, double reference_mps, double tolerance_m)
    : profile_(&profile),
      shallowest_m_(shallowest_m),
      deepest_m_(deepest_m),
      reference_mps_(reference_mps),
      tolerance_m_(tolerance_m),
      eigenrays_(profile, shallowest_m, deepest_m),
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

/// Collects the faces that the fan can touch, and some more.
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
        if (wedge.touches(0.5f * (low + high), 0.5001f * (high - low)))
          collected_.push_back(static_cast<std::uint32_t>(face));
      }
    }
  }
}

/// Adds a point of the sea; returns its number. Its ray does not depend on points added before.
std::uint32_t StraightenedSpace::add_point(const Vector3d& point) {
  const Vector2d out = (point - fan_->origin).head<2>();
  const double range_m = out.norm(), below_m = fan_->origin.z() - point.z();
  points_.push_back(point);
  RayToPoint& ray = rays_.emplace_back();
  Vector3f& to = mesh_.positions.emplace_back(Vector3f::Zero());
  scatter::DirectRays::Eigenray way;
  stands_high_ = stands_high_ || !(below_m > clearance_m);
  if (!stands_high_ && eigenrays_.find(range_m, -point.z(), way)) {
    const double sine = 1.0 / std::sqrt(1.0 + way.cotangent * way.cotangent);
    const double t = reference_mps_ * way.time_s;
    const double level = range_m > 0.0 ? t * way.cotangent * sine / range_m : 0.0;
    to = Vector3d(level * out.x(), level * out.y(), -t * sine).cast<float>();
    ray.cotangent = way.cotangent;
    const double cosine = way.cotangent * sine;
    const double along = cosine * way.sound_speed_mps / source_mps_;  // Snell
    const double down = std::sqrt(1.0 - along * along);
    const double spread_m = way.range_per_cotangent_m / (sine * sine) * down;
    // A step along the ray changes its time, a step across it its launch direction. So they become
    // steps along and across the launch direction, with these factors.
    const double forwards = reference_mps_ / way.sound_speed_mps, across = t / spread_m;
    const double out_by_out = forwards * cosine * along + across * sine * down;
    const double out_by_down = forwards * cosine * down - across * sine * along;
    const double down_by_out = forwards * sine * along - across * cosine * down;
    const double down_by_down = forwards * sine * down + across * cosine * along;
    const bool aside = cosine > 1e-6;  // else straight below
    const double sideways = aside ? level : t / way.range_per_cotangent_m;
    const double x = aside ? out.x() / range_m : 1.0, y = aside ? out.y() / range_m : 0.0;
    const double aslant = (out_by_out - sideways) * x * y;
    Matrix3d jacobian;
    jacobian << out_by_out * x * x + sideways * y * y, aslant, -out_by_down * x,  //
        aslant, out_by_out * y * y + sideways * x * x, -out_by_down * y,          //
        -down_by_out * x, -down_by_out * y, down_by_down;
    ray.jacobian.topRows<3>() = jacobian.cast<float>();
  }
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

/// Eight times the distance, squared, from the middle of an edge to the middle of its chord in
/// straightened space. A curve of constant second derivative is off by an eighth of the difference
/// of its tangents at the ends. The Jacobians turn with the direction to the point, so an edge
/// across the rays has a bow too, although rays of equal length lead to its ends.
float StraightenedSpace::bow8_m2(const RayToPoint& a, const RayToPoint& b, const Vector3d& edge) {
  if (a.cotangent == inf || b.cotangent == inf) return 0.0f;
  return ((b.jacobian - a.jacobian) * edge.cast<float>()).squaredNorm();
}

/// Adds a face, cut along its edges until all of them are straight enough. Faces that share an edge
/// cut it at the same points.
void StraightenedSpace::add_face(const refine::Face& whole, std::uint32_t place) {
  // If the middles of three edges are off by one bow, the middle of the face is off by 4/3 of it.
  const auto max_bow8_m2 = static_cast<float>(std::pow(8.0 * 0.75 * tolerance_m_, 2));
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
      if (length_m2 > longest_m2 && (length_m2 > longest_edge_m * longest_edge_m ||
                                     bow8_m2(rays_[from], rays_[to], edge) > max_bow8_m2)) {
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
    } else if (most == inf) {  // part of it no known ray reaches: the rays towards it are undecided
      flattest_ = std::min(flattest_, least);
    } else {
      mesh_.faces.push_back(face);
      face_place_.push_back(place);
    }
  }
}

/// Straightens the collected faces; false where one of them stands too high.
bool StraightenedSpace::straighten_faces() {
  point_slots_.assign(std::bit_ceil(4 * collected_.size() + 16), {none, none});
  points_.clear();
  rays_.clear();
  mesh_.positions.clear();
  mesh_.faces.clear();
  face_place_.clear();
  stands_high_ = false;
  source_mps_ = profile_->speed_mps(-fan_->origin.z());
  eigenrays_.start_at(-fan_->origin.z());
  flattest_ = eigenrays_.rays().flattest();
  for (const std::uint32_t place : collected_) {
    refine::Face face;
    for (std::size_t k = 0; k < 3; ++k) face[k] = point_of(triangles_.faces[place][k]);
    if (stands_high_) return false;
    add_face(face, place);
  }
  return true;
}

/// Whether an undecided ray may meet a face within range.
bool StraightenedSpace::may_hit(double level, double down, double farthest_m) const {
  // An upward ray returns only if faster water above turns it (Snell). After that, like a downward
  // ray, it lies beyond the flattest known ray at every depth, unless it is steeper.
  if (down <= 0.0 && fastest_above_mps_ * level <= source_mps_) return false;
  return std::abs(down) * eigenrays_.rays().flattest() > level || min_range_m_ <= farthest_m;
}

bool StraightenedSpace::trace(const RayFan& fan, const TracedFaces& faces, std::span<Hit> hits,
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
  const double source_m = -fan.origin.z();
  fastest_above_mps_ = fastest_mps(*profile_, std::min(0.0, source_m), source_m);
  const double depth_m = std::max(shallowest_m_, source_m + clearance_m);  // of the highest face
  {
    // Where the flattest known ray comes to that depth. Flatter ones that go down are farther out
    // there if none of them turns first.
    const bool none_turns = fastest_mps(*profile_, source_m, depth_m) <= source_mps_;
    min_range_m_ = none_turns ? eigenrays_.rays().farthest_m(depth_m) : 0.0;
  }
  RayFan straight = fan;
  straight.origin.setZero();
  scan_->build({mesh_.positions, mesh_.faces});
  scan_->intersect(straight, hits);

  // Whether a ray can be at that depth within range. Of two rays, upwards or downwards, the flatter
  // one has the smaller sine at each depth, so that it takes longer from the source's depth down.
  const auto way_down_m = [&](double cotangent) {
    scatter::DirectRays::Eigenray way;
    eigenrays_.rays().follow(cotangent, depth_m, way);
    return reference_mps_ * way.time_s;
  };
  // A ray that goes up first climbs to the water that is fast enough to turn it, and comes back.
  double slowest_above = source_mps_, steepest_above = 0.0;
  for (const SoundSpeedLayer& layer : profile_->layers())
    if (layer.top_m < source_m) {
      slowest_above = std::min({slowest_above, layer.top_mps, layer.bottom_mps});
      steepest_above = std::max(steepest_above, -layer.gradient_per_s);
    }
  const auto way_back_m = [&](double level) {
    const double height_m = (source_mps_ / level - source_mps_) / steepest_above;
    const double slow = level * slowest_above / source_mps_;
    return 2.0 * height_m * reference_mps_ / (fastest_above_mps_ * std::sqrt(1.0 - slow * slow));
  };
  const double flattest = eigenrays_.rays().flattest(), longest_m = way_down_m(flattest);
  const auto comes_in_time = [&](double level, double down) {
    const double above_m = down < 0.0 && steepest_above > 0.0 ? way_back_m(level) : 0.0;
    if (!(above_m <= fan.range_m)) return false;
    const bool known = level < flattest * std::abs(down);
    return above_m + (known ? way_down_m(level / std::abs(down)) : longest_m) <= fan.range_m;
  };
  const double farthest_m = fan.range_m * fan.bend.lengthening;
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
        hit.face = triangles_.number(hit.index);
      } else {
        hit = Hit{};
        const double level = std::sqrt(level2);
        if (fan.grid->within_beam(plane, elevation) && comes_in_time(level, down) &&
            may_hit(level, down, farthest_m))
          undecided.push_back(static_cast<std::uint32_t>(number));
      }
    }
  }
  return true;
}

// The ray to the hit as straightened space has it is known. The fan's own ray is next to it, by far
// less than their radius of curvature: at one depth it is farther out by the difference of their
// cotangents (times range_per_cotangent_m), and later by Snell's constant times that. From there it
// goes straight on to the plane of the face.
RayIncidence StraightenedSpace::incidence_of(std::size_t number, Hit& hit) {
  const RayFan& fan = *fan_;
  const Vector3d direction =
      fan.direction(fan.plane_direction(number / fan.elevations()), number % fan.elevations());
  const refine::Face& piece = mesh_.faces[hit_piece_[number]];
  Vector3d point = (1.0 - hit.u - hit.v) * points_[piece[0]] + hit.u * points_[piece[1]] +
                   hit.v * points_[piece[2]];
  const Vector3d a = triangles_.corner(hit.index, 0);
  const Vector3d ab = triangles_.corner(hit.index, 1) - a, ac = triangles_.corner(hit.index, 2) - a;
  const Vector3d normal = ab.cross(ac);
  const double level = direction.head<2>().norm(), sine = -direction.z();
  const double cotangent = level / sine, snell = level / source_mps_;
  const Vector2d outwards = level > 1e-6 ? Vector2d(direction.head<2>() / level) : Vector2d::Zero();
  double range_m = (point - fan.origin).head<2>().norm();
  scatter::DirectRays::Eigenray way;
  if (!eigenrays_.find(range_m, -point.z(), way))  // beyond the last by rounding
    way = {cotangent,
           hit.t / reference_mps_,
           hit.t,
           range_m / cotangent,
           profile_->speed_mps(-point.z()),
           hit.t * profile_->mean_absorption_db_per_m(-fan.origin.z(), -point.z())};
  const double along = snell * way.sound_speed_mps;
  const double down = std::sqrt(std::max(0.0, 1.0 - along * along));
  const Vector3d travel(along * outwards.x(), along * outwards.y(), -down);
  Vector3d near = point;
  double farther_m = 0.0;
  if (level > 1e-6) {
    farther_m = (cotangent - way.cotangent) * way.range_per_cotangent_m;
    near.head<2>() = fan.origin.head<2>() + (range_m + farther_m) * outwards;
  }
  const double step_m = normal.dot(a - near) / normal.dot(travel);
  if (std::abs(step_m) < longest_edge_m) {  // else seen edge on
    point = near + step_m * travel;
    range_m += farther_m + step_m * along;
    hit.t = reference_mps_ * (way.time_s + snell * farther_m + step_m / way.sound_speed_mps);
  }
  const double spread_m = way.range_per_cotangent_m * (1.0 + cotangent * cotangent) * down;
  const double sideways_m = level > 1e-6 ? range_m / level : way.range_per_cotangent_m;
  const double per_t = 1.0 / hit.t, speeds = source_mps_ / way.sound_speed_mps;
  return {.place = point,
          .direction = travel,
          .spreading_m2 = speeds * speeds *
                          std::max(spread_m * sideways_m, min_spreading * way.path_m * way.path_m),
          .absorption_db = way.absorption_db,
          .along = way.sound_speed_mps / reference_mps_,
          .upwards = std::max(spread_m * per_t, 0.01),
          .sideways = sideways_m * per_t};
}

}  // namespace ensonify::engine
