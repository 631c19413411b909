#include <ensonify/engine/trace/refraction/refracted_path.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

namespace ensonify::engine {
namespace {

using scatter::SoundRay;
using scatter::SoundSpeedLayer;
using scatter::SoundSpeedProfile;

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
constexpr double fine_sagitta_m = 1e-6;  // below what a tracer in float keeps of a kilometre
constexpr double overlap_m = 1e-4;       // of chords, so that no face lies between two
constexpr std::size_t batch = 256;       // rays at work at a time, which the cache holds

/// The same speeds with one more edge, there or a little above, where samples would merge; none
/// above the surface.
SoundSpeedProfile with_edge(const SoundSpeedProfile& profile, double& depth_m) {
  constexpr double apart_m = 2e-3;
  std::vector<scatter::SoundSpeedSample> samples;
  for (const SoundSpeedLayer& layer : profile.layers())
    if (std::isfinite(layer.top_m))
      samples.push_back({layer.top_m, layer.top_mps, layer.top_db_per_m});
  for (auto s = samples.rbegin(); s != samples.rend(); ++s)
    if (std::abs(s->depth_m - depth_m) < apart_m) depth_m = s->depth_m - apart_m;
  if (depth_m >= 0.0)
    samples.push_back(
        {depth_m, profile.speed_mps(depth_m), profile.mean_absorption_db_per_m(depth_m, depth_m)});
  return SoundSpeedProfile(std::move(samples));
}

double fastest(const SoundSpeedProfile& profile) {
  return std::ranges::max(profile.layers(), {}, &SoundSpeedLayer::top_mps).top_mps;
}

Eigen::Vector2d level_of(const Eigen::Vector3d& direction) {
  const Eigen::Vector2d level = direction.head<2>();
  const double along = level.norm();
  return along > 0.0 ? Eigen::Vector2d(level / along) : Eigen::Vector2d::UnitX();
}

Eigen::Vector3d along_ray(const SoundRay& ray, const Eigen::Vector2d& level) {
  const auto& [along, down] = std::pair(ray.point().along, ray.point().down);
  return {along * level.x(), along * level.y(), -down};
}

void advance_by(SoundRay& ray, double path_m) {
  for (double edge_m; (edge_m = ray.path_to_edge_m()) <= path_m; path_m -= edge_m)
    ray.advance(edge_m);
  if (path_m != 0.0) ray.advance(path_m);
}

}  // namespace

Eigen::Vector3d RayIncidence::straightened(const Eigen::Vector3d& normal,
                                           const Eigen::Vector3d& launch) const {
  const Eigen::Vector2d level = level_of(launch);
  const auto upwards_of = [&](const Eigen::Vector3d& d) {
    const double down = -d.z();
    return Eigen::Vector3d(down * level.x(), down * level.y(), d.head<2>().dot(level));
  };
  const Eigen::Vector3d beside(-level.y(), level.x(), 0.0);
  return (along * normal.dot(direction) * launch +
          upwards * normal.dot(upwards_of(direction)) * upwards_of(launch) +
          sideways * normal.dot(beside) * beside)
      .normalized();
}

RayIncidence RayIncidence::onwards(double times, const Eigen::Vector3d& way) const {
  RayIncidence beyond = *this;
  beyond.place += way;
  beyond.spreading_m2 *= times * times;
  beyond.absorption_db *= times;
  return beyond;
}

RefractionCounts& RefractionCounts::operator+=(const RefractionCounts& other) {
  rays += other.rays;
  straightened += other.straightened;
  chords += other.chords;
  finely += other.finely;
  return *this;
}

RefractedTracer::RefractedTracer(const SoundSpeedProfile& profile, double highest_m,
                                 double deepest_m, double reference_mps, double sagitta_m)
    : top_m_(-highest_m),
      profile_(with_edge(profile, top_m_)),
      reference_mps_(reference_mps),
      sagitta_m_(sagitta_m),
      fastest_mps_(fastest(profile)),
      picture_(profile, -highest_m, deepest_m, reference_mps, 0.5 * sagitta_m) {}

Eigen::Vector3d RefractedTracer::place(const Course& course, const Eigen::Vector3d& origin,
                                       const SoundRay& at) {
  const double range_m = at.point().range_m;
  return {origin.x() + range_m * course.level.x(), origin.y() + range_m * course.level.y(),
          -at.point().depth_m};
}

void RefractedTracer::trace(const RayFan& fan, const Intersector* lists,
                            refine::Triangles triangles, std::uint64_t version,
                            std::span<Hit> hits) {
  triangles_ = triangles;
  version_ = version;
  courses_.clear();
  by_chords_.clear();
  chord_place_.assign(hits.size(), none);
  pictured_ = picture_.trace(fan, triangles, version, hits, left_);
  if (!pictured_) {
    std::ranges::fill(hits, Hit{});
    left_.clear();
  }
  std::size_t rays = 0;
  for (std::size_t plane = 0; plane < fan.planes(); ++plane)
    for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation) {
      if (!fan.grid->within_beam(plane, elevation)) continue;
      ++rays;
      if (!pictured_)
        left_.push_back(static_cast<std::uint32_t>(plane * fan.elevations() + elevation));
    }
  counts_.rays += rays;
  counts_.straightened += rays - left_.size();
  for (const std::uint32_t number : left_) {
    start(fan, number);
    if (courses_.size() == batch) follow(fan, lists, hits);
  }
  follow(fan, lists, hits);
}

RayIncidence RefractedTracer::tell(std::size_t number, Hit& hit) {
  const std::uint32_t place = chord_place_[number];
  return place == none ? picture_.tell(number, hit) : by_chords_[place];
}

const Intersector& RefractedTracer::own_tree() {
  if (own_version_ != version_) {
    own_tree_ = make_intersector("pluecker", triangles_);
    own_version_ = version_;
  }
  return *own_tree_;
}

/// A ray under way to what its chords will find, if it comes to where faces are.
void RefractedTracer::start(const RayFan& fan, std::uint32_t number) {
  const Eigen::Vector3d in_plane = fan.plane_direction(number / fan.elevations());
  const Eigen::Vector3d direction = fan.direction(in_plane, number % fan.elevations()).normalized();
  SoundRay ray(profile_, -fan.origin.z(), direction.head<2>().norm(), -direction.z());
  if (reach_faces(ray, fan.range_m)) courses_.push_back({ray, ray, level_of(direction), number});
}

/// Chord by chord, until all rays have hit or ended.
void RefractedTracer::follow(const RayFan& fan, const Intersector* lists, std::span<Hit> hits) {
  while (!courses_.empty()) {
    chords_.clear();
    std::erase_if(courses_, [&](Course& course) {
      if (!reach_faces(course.to, fan.range_m) ||
          !next_chord(course, sagitta_m_, end_path_m(course.to, fan.range_m)))
        return true;
      const Eigen::Vector3d from = place(course, fan.origin, course.from);
      const Eigen::Vector3d way = place(course, fan.origin, course.to) - from;
      chords_.push_back({from, way, 0.0, 1.0 + overlap_m / way.norm()});
      return false;
    });
    if (chords_.empty()) return;
    counts_.chords += chords_.size();
    found_.resize(chords_.size());
    const Intersector& tree = lists ? *lists : own_tree();
    tree.intersect(chords_, found_);
    std::size_t i = 0;
    std::erase_if(courses_, [&](const Course& course) {
      const Hit& found = found_[i++];
      if (!found) return false;
      RayIncidence arrival;
      Hit hit = settle(course, fan.origin, found, false, arrival);
      if (!hit) {
        ++counts_.finely;
        hit = ask_finely(course, fan, tree, arrival);
      }
      if (!hit) return false;
      if (hit.t <= fan.range_m) {
        hits[course.number] = hit;
        chord_place_[course.number] = static_cast<std::uint32_t>(by_chords_.size());
        by_chords_.push_back(arrival);
      }
      return true;
    });
  }
}

/// On through the sea above all faces; false if the ray ends there.
bool RefractedTracer::reach_faces(SoundRay& ray, double range_m) const {
  for (;;) {
    const scatter::SoundRayPoint& p = ray.point();
    if (reference_mps_ * p.time_s >= range_m) return false;
    if (p.depth_m > top_m_ || (p.depth_m == top_m_ && p.down >= 0.0)) return true;
    if (ray.path_to_edge_m() == inf) return false;
    ray.advance(ray.path_to_edge_m());
  }
}

/// At or behind the path at which the ray ends.
double RefractedTracer::end_path_m(const SoundRay& ray, double range_m) const {
  const double left_s = range_m / reference_mps_ - ray.point().time_s;
  return ray.point().path_m + left_s * fastest_mps_ + overlap_m;
}

/// The next chord, of as much of the ray as stays within the sagitta, the sea above the faces and
/// the path; false at the path's end.
bool RefractedTracer::next_chord(Course& course, double sagitta_m, double end_path_m) const {
  course.from = course.to;
  SoundRay& ray = course.to;
  const double left_m = end_path_m - ray.point().path_m;
  if (!(left_m > 0.0)) return false;
  double turned = 0.0, length_m = 0.0;
  while (length_m < left_m) {
    const double curvature = std::abs(ray.curvature_per_m());
    const double on_m = std::min(ray.path_to_edge_m(), left_m - length_m);
    if ((turned + curvature * on_m) * (length_m + on_m) > 4.0 * sagitta_m) {
      const double room = 4.0 * sagitta_m - turned * length_m;
      const double b = turned + curvature * length_m;
      ray.advance(2.0 * room / (b + std::sqrt(b * b + 4.0 * curvature * room)));
      return true;
    }
    ray.advance(on_m);
    turned += curvature * on_m;
    length_m += on_m;
    if (ray.point().depth_m <= top_m_ && ray.point().down < 0.0) break;
  }
  return true;
}

/// The exact ray's hit on the face that its chord found; none where it misses the face, unless
/// nothing finer is to be had.
Hit RefractedTracer::settle(const Course& course, const Eigen::Vector3d& origin, const Hit& found,
                            bool finely, RayIncidence& arrival) const {
  const Eigen::Vector3d a = triangles_.corner(found.index, 0);
  const Eigen::Vector3d ab = triangles_.corner(found.index, 1) - a;
  const Eigen::Vector3d ac = triangles_.corner(found.index, 2) - a;
  const Eigen::Vector3d normal = ab.cross(ac);
  const double chord_m = course.to.point().path_m - course.from.point().path_m;
  SoundRay at = course.from;
  advance_by(at, std::min(found.t, 1.0) * chord_m);
  Eigen::Vector3d point = place(course, origin, at);
  for (int i = 0; i < 8;
       ++i) {  // Newton's steps onto the plane; a few, as arcs are almost straight
    const double step_m = normal.dot(a - point) / normal.dot(along_ray(at, course.level));
    if (!(std::abs(step_m) <= chord_m)) {  // seen edge on
      if (!finely) return {};
      break;
    }
    advance_by(at, step_m);
    point = place(course, origin, at);
    if (std::abs(step_m) < 1e-9) break;
  }
  const Eigen::Vector3d way = point - a;
  const double area2 = normal.squaredNorm();
  double u = way.cross(ac).dot(normal) / area2, v = ab.cross(way).dot(normal) / area2;
  if (!(u >= 0.0 && v >= 0.0 && u + v <= 1.0)) {
    if (!finely) return {};
    u = found.u, v = found.v;
  }
  const double t = reference_mps_ * at.point().time_s;
  arrival = {.place = point,
             .direction = along_ray(at, course.level),
             .spreading_m2 = at.spreading_back_m2(),
             .absorption_db = at.point().absorption_db,
             .along = at.point().sound_speed_mps / reference_mps_,
             .upwards = std::max(std::abs(at.spread_m()) / t, 0.01),
             .sideways = at.sideways_m() / t};
  return {found.face, found.index, t, u, v};
}

/// The chord's arc again, by chords so short that they are the arc.
Hit RefractedTracer::ask_finely(Course course, const RayFan& fan, const Intersector& tree,
                                RayIncidence& arrival) {
  const double end_path_m = course.to.point().path_m;
  course.to = course.from;
  while (next_chord(course, fine_sagitta_m, end_path_m)) {
    const Eigen::Vector3d from = place(course, fan.origin, course.from);
    const Eigen::Vector3d way = place(course, fan.origin, course.to) - from;
    const Ray chord{from, way, 0.0, 1.0 + overlap_m / way.norm()};
    Hit found;
    tree.intersect({&chord, 1}, {&found, 1});
    ++counts_.chords;
    if (found) return settle(course, fan.origin, found, true, arrival);
  }
  return {};
}

void TravelTime::apply(const RayFan& fan, std::span<Hit> hits) {
  fan_ = &fan;
  straight_m_.resize(hits.size());
  const double source_s = straight_down(-fan.origin.z()).time_s;
  for (std::size_t plane = 0; plane < fan.planes(); ++plane) {
    const double in_plane_z = fan.plane_direction(plane).z();
    for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation) {
      const std::size_t number = plane * fan.elevations() + elevation;
      Hit& hit = hits[number];
      if (!hit) continue;
      const double deeper_m = -hit.t * (fan.grid->cos_elevation[elevation] * in_plane_z +
                                        fan.grid->sin_elevation[elevation] * fan.pole.z());
      const Down here = straight_down(deeper_m - fan.origin.z());
      straight_m_[number] = hit.t;
      hit.t *= reference_mps_ *
               (std::abs(deeper_m) > 1e-3 ? (here.time_s - source_s) / deeper_m : 1.0 / here.mps);
      if (hit.t > fan.range_m) hit = Hit{};
    }
  }
}

RayIncidence TravelTime::tell(std::size_t number, Hit& hit) {
  const Eigen::Vector3d direction = fan_->direction(
      fan_->plane_direction(number / fan_->elevations()), number % fan_->elevations());
  const double straight_m = straight_m_[number];
  const Eigen::Vector3d place = fan_->origin + straight_m * direction;
  return {.place = place,
          .direction = direction,
          .spreading_m2 = straight_m * straight_m,
          .absorption_db =
              straight_m * profile_->mean_absorption_db_per_m(-fan_->origin.z(), -place.z()),
          .along = straight_down(-place.z()).mps / reference_mps_,
          .upwards = straight_m / hit.t,
          .sideways = straight_m / hit.t};
}

TravelTime::TravelTime(const SoundSpeedProfile& profile, double reference_mps)
    : profile_(&profile), reference_mps_(reference_mps) {
  for (const SoundSpeedLayer& layer : profile.layers())
    edge_s_.push_back(
        std::isinf(layer.top_m) ? 0.0 : layer.top_m / profile.mean_speed_mps(0.0, layer.top_m));
}

/// From the surface: to the layer's top, and on through it.
TravelTime::Down TravelTime::straight_down(double depth_m) const {
  const std::size_t i = profile_->layer_index(depth_m);
  const SoundSpeedLayer& layer = profile_->layers()[i];
  if (i == 0) return {depth_m / layer.top_mps, layer.top_mps};
  const double dz = depth_m - layer.top_m, x = layer.gradient_per_s * dz / layer.top_mps;
  // log(1 + x) / x; the series' next term is below rounding.
  const double stretch =
      std::abs(x) > 5e-3
          ? std::log1p(x) / x
          : 1.0 - x * (1.0 / 2 - x * (1.0 / 3 - x * (1.0 / 4 - x * (1.0 / 5 - x * (1.0 / 6)))));
  return {edge_s_[i] + dz / layer.top_mps * stretch, layer.top_mps + layer.gradient_per_s * dz};
}

// A tangent turns by the curvature, at most the largest gradient over the slowest speed, times the
// path; and by Snell's law not past the angle at which the fastest turns, twice: from one side of
// the level to the other. The ray's point is the sum of its tangents, so within that angle, too;
// its distance is at least the path times the angle's cosine, and its level part at most the path
// times the most level tangent's.
FanBend bend(const SoundSpeedProfile& profile, double deepest_m, double range_m,
             double reference_mps) {
  double slowest_mps = inf, fastest_mps = 0.0, steepest_per_s = 0.0;
  for (const SoundSpeedLayer& layer : profile.layers()) {
    if (layer.top_m > deepest_m) break;
    slowest_mps = std::min({slowest_mps, layer.top_mps, layer.bottom_mps});
    fastest_mps = std::max({fastest_mps, layer.top_mps, layer.bottom_mps});
    steepest_per_s = std::max(steepest_per_s, std::abs(layer.gradient_per_s));
  }
  const double lengthening = std::max(fastest_mps / reference_mps, 1.0);
  const double turn_rad = std::min(steepest_per_s / slowest_mps * range_m * lengthening,
                                   2.0 * std::acos(slowest_mps / fastest_mps));
  if (turn_rad > 1.0) return {std::numbers::pi, 1e9, lengthening};  // any direction
  return {turn_rad, fastest_mps / slowest_mps / std::cos(turn_rad), lengthening};
}

}  // namespace ensonify::engine
