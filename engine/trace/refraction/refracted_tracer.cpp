#include <ensonify/engine/trace/refraction/refracted_tracer.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/beam_ranges.h>
#include <ensonify/scatter/eigenray.h>

namespace ensonify::engine {
namespace {

using scatter::SoundRay;
using scatter::SoundSpeedLayer;
using scatter::SoundSpeedProfile;

constexpr std::uint32_t no_chord = std::numeric_limits<std::uint32_t>::max();
constexpr double usual_sagitta_m = 1e-3;  // of chords: how far they stray from the ray
constexpr double fine_sagitta_m = 1e-6;   // below what a tracer in float keeps of a kilometre
constexpr double flat_within_m = 0.5 * usual_sagitta_m;
constexpr double overlap_m = 1e-4;  // of chords, so that no face lies between two
constexpr std::size_t batch = 256;  // rays followed at a time: they fit the cache

/// Adds the edge of a layer at `depth_m` and keeps the speeds. If a sample is near, the edge (and
/// `depth_m`) moves to a little above the sample. Adds no edge above the sea surface.
SoundSpeedProfile with_edge(const SoundSpeedProfile& profile, double& depth_m) {
  constexpr double apart_m = 2e-3;
  std::vector<scatter::SoundSpeedSample> samples;
  for (const SoundSpeedLayer& layer : profile.layers())
    if (std::isfinite(layer.top_m))
      samples.push_back({layer.top_m, layer.top_mps, layer.top_db_per_m});
  for (std::size_t i = samples.size(); i-- > 0;)
    if (std::abs(samples[i].depth_m - depth_m) < apart_m) depth_m = samples[i].depth_m - apart_m;
  if (depth_m >= 0.0)
    samples.push_back(
        {depth_m, profile.speed_mps(depth_m), profile.mean_absorption_db_per_m(depth_m, depth_m)});
  return SoundSpeedProfile(std::move(samples));
}

Eigen::Vector3d direction_of(const SoundRay& ray, const Eigen::Vector2d& outwards) {
  const double along = ray.point().along, down = ray.point().down;
  return {along * outwards.x(), along * outwards.y(), -down};
}

void advance_by(SoundRay& ray, double path_m) {
  for (double edge_m; (edge_m = ray.path_to_edge_m()) <= path_m; path_m -= edge_m)
    ray.advance(edge_m);
  if (path_m != 0.0) ray.advance(path_m);
}

}  // namespace

RefractionCounts& RefractionCounts::operator+=(const RefractionCounts& other) {
  rays += other.rays;
  straightened += other.straightened;
  chords += other.chords;
  refined += other.refined;
  return *this;
}

RefractionCounts RefractionCounts::operator-(const RefractionCounts& other) const {
  return {rays - other.rays, straightened - other.straightened, chords - other.chords,
          refined - other.refined};
}

RefractedTracer::RefractedTracer(const SoundSpeedProfile& profile, double highest_m,
                                 double deepest_m, double reference_mps, bool takes_lists)
    : top_m_(-highest_m),
      profile_(with_edge(profile, top_m_)),
      reference_mps_(reference_mps),
      takes_lists_(takes_lists),
      fastest_mps_(std::ranges::max(profile.layers(), {}, &SoundSpeedLayer::top_mps).top_mps),
      straightening_(
          std::make_unique<Straightening>(profile, -highest_m, deepest_m, reference_mps)),
      straightened_space_(*straightening_, flat_within_m) {}

void RefractedTracer::trace(const RayFan& fan, TracedFaces& faces, std::span<Hit> hits) {
  const auto* const bed = std::get_if<BedAndObjects>(&faces);
  if (!bed || !trace_bed(fan, *bed, hits)) trace(fan, all_faces(faces), hits);
}

void RefractedTracer::trace(const RayFan& fan, const Faces& faces, std::span<Hit> hits) {
  faces_ = faces;
  on_bed_ = false;
  courses_.clear();
  by_chords_.clear();
  chord_place_.assign(hits.size(), no_chord);
  const bool straightened = straightened_space_.trace(fan, faces, hits, undecided_);
  if (!straightened) {
    std::ranges::fill(hits, Hit{});
    undecided_.clear();
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation)
        if (fan.grid->within_beam(plane, elevation))
          undecided_.push_back(static_cast<std::uint32_t>(plane * fan.elevations() + elevation));
  }
  const std::uint64_t rays = rays_within_beam(*fan.grid);
  counts_.rays += rays;
  counts_.straightened += rays - undecided_.size();
  for (const std::uint32_t number : undecided_) {
    start(fan, number);
    if (courses_.size() == batch) follow(fan, hits);
  }
  follow(fan, hits);
}

/// Finds the nearer hits of a bed and its objects. Returns false if straightened space does not
/// decide all rays.
bool RefractedTracer::trace_bed(const RayFan& fan, const BedAndObjects& faces,
                                std::span<Hit> hits) {
  faces_ = faces.objects;
  on_bed_ = true;
  if (grid_ != faces.bed) {
    grid_ = faces.bed;
    bed_.emplace(*grid_, *straightening_, flat_within_m);
  }
  straightening_->start(fan);
  const bool objects = !faces_.triangles.faces.empty();
  bed_->keep_first(faces_.triangles, faces_.version, {&fan, 1});
  if (!bed_->trace(fan, hits)) return false;
  chord_place_.clear();
  of_objects_.clear();
  if (objects) {
    of_objects_.resize(hits.size());
    if (!straightened_space_.trace(fan, faces_, of_objects_, undecided_) || !undecided_.empty())
      return false;
    for (std::size_t i = 0; i < hits.size(); ++i)
      if (of_objects_[i].t < hits[i].t) hits[i] = of_objects_[i];
  }
  const std::uint64_t rays = rays_within_beam(*fan.grid);
  counts_.rays += rays;
  counts_.straightened += rays;
  return true;
}

RayIncidence RefractedTracer::incidence_of(std::size_t number, Hit& hit) {
  if (on_bed_)
    return hit.index < faces_.triangles.faces.size() ? straightened_space_.incidence_of(number, hit)
                                                     : bed_->incidence_of(number, hit);
  const std::uint32_t place = chord_place_[number];
  return place == no_chord ? straightened_space_.incidence_of(number, hit) : by_chords_[place];
}

std::optional<RayToPlace> RefractedTracer::ray_to(const Eigen::Vector3d& origin,
                                                  const Eigen::Vector3d& away) const {
  const auto arrived = scatter::find_near_eigenray(profile_, {.source_depth_m = -origin.z(),
                                                              .range_m = away.head<2>().norm(),
                                                              .depth_m = -(origin.z() + away.z())});
  if (!arrived) return std::nullopt;
  const Eigen::Vector2d outwards = horizontal(away);
  const SoundRay& ray = arrived->ray;
  const double distance_m = std::pow(ray.spreading_m2() * ray.spreading_back_m2(), 0.25);
  return RayToPlace{
      .launch = {arrived->along * outwards.x(), arrived->along * outwards.y(), -arrived->down},
      .apparent = distance_m * direction_of(ray, outwards),
      .range_m = reference_mps_ * ray.point().time_s,
      .absorption_db = ray.point().absorption_db};
}

/// The intersector for lists of chords.
const Intersector& RefractedTracer::tree() {
  if (takes_lists_) return *faces_.intersector;
  if (own_version_ != faces_.version) {
    own_tree_ = make_intersector(reference_intersector, faces_.triangles);
    own_version_ = faces_.version;
  }
  return *own_tree_;
}

/// The place of a ray of a course.
Eigen::Vector3d RefractedTracer::place(const Course& course, const Eigen::Vector3d& origin,
                                       const SoundRay& at) {
  const double range_m = at.point().range_m;
  return {origin.x() + range_m * course.outwards.x(), origin.y() + range_m * course.outwards.y(),
          -at.point().depth_m};
}

/// The chord of a course. Its t runs from 0 to a little beyond 1.
Ray RefractedTracer::chord_of(const Course& course, const Eigen::Vector3d& origin) {
  const Eigen::Vector3d from = place(course, origin, course.from);
  const Eigen::Vector3d way = place(course, origin, course.to) - from;
  return {from, way, 0.0, 1.0 + overlap_m / way.norm()};
}

/// Starts to follow a ray, if it reaches the depths where faces are.
void RefractedTracer::start(const RayFan& fan, std::uint32_t number) {
  const Eigen::Vector3d in_plane = fan.plane_direction(number / fan.elevations());
  const Eigen::Vector3d direction = fan.direction(in_plane, number % fan.elevations()).normalized();
  SoundRay ray(profile_, -fan.origin.z(), direction.head<2>().norm(), -direction.z());
  if (reach_faces(ray, fan.range_m)) courses_.push_back({ray, ray, horizontal(direction), number});
}

/// Follows all started rays chord by chord, until each has hit or ended.
void RefractedTracer::follow(const RayFan& fan, std::span<Hit> hits) {
  while (!courses_.empty()) {
    chords_.clear();
    std::erase_if(courses_, [&](Course& course) {
      if (!reach_faces(course.to, fan.range_m) ||
          !next_chord(course, usual_sagitta_m, end_path_m(course.to, fan.range_m)))
        return true;
      chords_.push_back(chord_of(course, fan.origin));
      return false;
    });
    if (chords_.empty()) return;
    counts_.chords += chords_.size();
    found_.resize(chords_.size());
    tree().intersect(chords_, found_);
    std::size_t i = 0;
    std::erase_if(courses_, [&](const Course& course) {
      const Hit& found = found_[i++];
      if (!found) return false;
      RayIncidence incidence;
      Hit hit = cut_arc(course, fan.origin, found, false, incidence);
      if (!hit) {
        ++counts_.refined;
        hit = trace_finely(course, fan, incidence);
      }
      if (!hit) return false;
      if (hit.t <= fan.range_m) {
        hits[course.number] = hit;
        chord_place_[course.number] = static_cast<std::uint32_t>(by_chords_.size());
        by_chords_.push_back(incidence);
      }
      return true;
    });
  }
}

/// Advances a ray through the sea above all faces. Returns false if the ray ends there.
bool RefractedTracer::reach_faces(SoundRay& ray, double range_m) const {
  for (;;) {
    const scatter::SoundRayPoint& p = ray.point();
    if (reference_mps_ * p.time_s >= range_m) return false;
    if (p.depth_m > top_m_ || (p.depth_m == top_m_ && p.down >= 0.0)) return true;
    if (ray.path_to_edge_m() == std::numeric_limits<double>::infinity()) return false;
    ray.advance(ray.path_to_edge_m());
  }
}

/// The path at which the ray ends, or a longer one.
double RefractedTracer::end_path_m(const SoundRay& ray, double range_m) const {
  const double left_s = range_m / reference_mps_ - ray.point().time_s;
  return ray.point().path_m + left_s * fastest_mps_ + overlap_m;
}

/// Advances a course by one chord, which is as long as the ray stays within the sagitta of the
/// chord, below the highest face, and before the end of the path. Returns false at that end.
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

/// Intersects the exact ray with the face that its chord found. If the ray misses the face, returns
/// no hit; but in the last try it takes the hit of the chord.
Hit RefractedTracer::cut_arc(const Course& course, const Eigen::Vector3d& origin, const Hit& found,
                             bool last_try, RayIncidence& incidence) const {
  const Eigen::Vector3d a = faces_.triangles.corner(found.index, 0);
  const Eigen::Vector3d ab = faces_.triangles.corner(found.index, 1) - a;
  const Eigen::Vector3d ac = faces_.triangles.corner(found.index, 2) - a;
  const Eigen::Vector3d normal = ab.cross(ac);
  const double chord_m = course.to.point().path_m - course.from.point().path_m;
  SoundRay at = course.from;
  advance_by(at, std::min(found.t, 1.0) * chord_m);
  Eigen::Vector3d point = place(course, origin, at);
  // Newton's steps onto the plane: few, because arcs are almost straight.
  for (int i = 0; i < 8; ++i) {
    const double step_m = normal.dot(a - point) / normal.dot(direction_of(at, course.outwards));
    if (!(std::abs(step_m) <= chord_m)) {  // seen edge on
      if (!last_try) return {};
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
    if (!last_try) return {};
    u = found.u, v = found.v;
  }
  const double t = reference_mps_ * at.point().time_s;
  const double spread_m = at.spread_m(), source_mps = profile_.speed_mps(-origin.z());
  const double along = at.point().sound_speed_mps / reference_mps_;
  incidence = {.place = point,
               .direction = direction_of(at, course.outwards),
               .spreading_m2 = at.spreading_back_m2(),
               .absorption_db = at.point().absorption_db,
               .along = along,
               .upwards = std::copysign(std::max(std::abs(spread_m) / t, 0.01), spread_m),
               .sideways = at.sideways_m() / t,
               .turn_along = at.curvature_per_m() * along,
               .turn_upwards = at.spread_rate() / t,
               .turn_sideways = at.point().sound_speed_mps / source_mps / t};
  return {found.face, found.index, t, u, v};
}

/// Traces the arc of a course's chord again, by chords so short that they are the arc.
Hit RefractedTracer::trace_finely(Course course, const RayFan& fan, RayIncidence& incidence) {
  const double end_path_m = course.to.point().path_m;
  course.to = course.from;
  while (next_chord(course, fine_sagitta_m, end_path_m)) {
    const Ray chord = chord_of(course, fan.origin);
    Hit found;
    tree().intersect({&chord, 1}, {&found, 1});
    ++counts_.chords;
    if (found) return cut_arc(course, fan.origin, found, true, incidence);
  }
  return {};
}

}  // namespace ensonify::engine
