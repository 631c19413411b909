#include <ensonify/engine/trace/check/bent_rays.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include <ensonify/engine/trace/refraction/ray_incidence.h>
#include <ensonify/scatter/sound_ray.h>

namespace ensonify::engine {

using Eigen::Vector2d;
using Eigen::Vector3d;
using scatter::SoundRay;
using scatter::SoundSpeedProfile;

namespace {

constexpr double sagitta_m = 1e-5;  // of the chords
constexpr double reach_m = 1e-3;    // within which a run decides which face a ray hits
// In 1.2 million rays (refracted_agreement_test.cpp) the worst t was off by 0.02 mm.
constexpr double tolerance_m = 1e-4;

SoundRay start(const SoundSpeedProfile& profile, const Ray& launch) {
  const Vector3d& d = launch.direction;
  return {profile, -launch.origin.z(), d.head<2>().norm(), -d.z()};
}

Vector3d place(const Ray& launch, const SoundRay& at) {
  const Vector2d level = at.point().range_m * horizontal(launch.direction);
  return {launch.origin.x() + level.x(), launch.origin.y() + level.y(), -at.point().depth_m};
}

}  // namespace

BentReference::BentReference(const BentWater& water, refine::Triangles triangles,
                             const Intersector& exact)
    : water_(water), triangles_(triangles), exact_(exact) {}

/// The signed distance from the plane of a face to a point.
double BentReference::off_plane_m(std::uint32_t face, const Vector3d& point) const {
  const Vector3d a = triangles_.corner(face, 0);
  const Vector3d ab = triangles_.corner(face, 1) - a, ac = triangles_.corner(face, 2) - a;
  return ab.cross(ac).normalized().dot(point - a);
}

/// Whether the ray is on the found face at the found time: in its plane, and as the ray sees it no
/// farther than the reach beyond the line of an edge.
bool BentReference::is_on_face(const Ray& launch, const Hit& found) const {
  if (found.face >= triangles_.faces.size()) return false;
  SoundRay ray = start(*water_.profile, launch);
  for (int i = 0; i < 1000; ++i) {
    const double left_s = found.t / water_.reference_mps - ray.point().time_s;
    if (std::abs(left_s) < 1e-12) break;
    ray.advance(std::min(left_s * ray.point().sound_speed_mps, ray.path_to_edge_m()));
  }
  const Vector3d point = place(launch, ray);
  if (std::abs(off_plane_m(found.face, point)) > tolerance_m) return false;
  const Vector2d outwards = horizontal(launch.direction);
  const Vector3d direction(ray.point().along * outwards.x(), ray.point().along * outwards.y(),
                           -ray.point().down);
  std::array<Vector3d, 3> corners;
  for (int k = 0; k < 3; ++k)
    corners[static_cast<std::size_t>(k)] = triangles_.corner(found.face, k) - point;
  const auto& [a, b, c] = corners;
  const double turn = direction.dot((b - a).cross(c - a)) > 0.0 ? 1.0 : -1.0;
  for (const auto& [p, q] : {std::pair(a, b), {b, c}, {c, a}}) {
    const double length_m = (q - p).cross(direction).norm();  // as the ray sees the edge
    if (turn * direction.dot(p.cross(q)) < -reach_m * length_m) return false;
  }
  return true;
}

Hit BentReference::trace(const Ray& launch) const {
  SoundRay ray = start(*water_.profile, launch);
  while (water_.reference_mps * ray.point().time_s < launch.t_max) {
    const SoundRay from = ray;
    const double curvature = std::abs(ray.curvature_per_m());
    double step_m = curvature > 0.0 ? std::sqrt(8.0 * sagitta_m / curvature) : launch.t_max;
    step_m = std::min(step_m, launch.t_max);
    const bool above = ray.point().depth_m < -water_.highest_m - 2.0 && ray.point().down > 0.0;
    if (above) step_m = std::max(step_m, 0.5);  // no faces there
    ray.advance(std::min(step_m, ray.path_to_edge_m()));
    if (above && ray.point().depth_m < -water_.highest_m - 1.0) continue;
    const Vector3d begin = place(launch, from);
    const Ray chord{begin, place(launch, ray) - begin, 0.0, 1.0};
    if (chord.direction.norm() == 0.0) continue;
    Hit hit;
    exact_.intersect({&chord, 1}, {&hit, 1});
    if (!hit) continue;
    const auto is_above = [&](double path_m) {
      SoundRay at = from;
      at.advance(path_m);
      return off_plane_m(hit.index, place(launch, at)) > 0.0;
    };
    const bool begins = is_above(0.0);
    double low_m = 0.0, high_m = ray.point().path_m - from.point().path_m;
    for (int i = 0; i < 60; ++i) {
      const double middle_m = 0.5 * (low_m + high_m);
      (is_above(middle_m) == begins ? low_m : high_m) = middle_m;
    }
    SoundRay at = from;
    at.advance(low_m);
    hit.t = water_.reference_mps * at.point().time_s;
    return hit.t <= launch.t_max ? hit : Hit{};
  }
  return {};
}

std::vector<BentRay> BentReference::trace_some(const RayFan& fan, std::uint64_t every,
                                               std::uint64_t& turn) const {
  std::vector<BentRay> some;
  for (std::size_t plane = 0; plane < fan.planes(); ++plane)
    for (std::size_t j = 0; j < fan.elevations(); ++j) {
      if (!fan.grid->within_beam(plane, j) || turn++ % every != 0) continue;
      Ray launch = fan.ray(plane, j);
      launch.direction.normalize();
      some.push_back({plane * fan.elevations() + j, launch, trace(launch)});
    }
  return some;
}

void BentReference::compare(const RayFan& fan, std::span<const BentRay> some,
                            RefractedTracer& tracer, TracedFaces& faces,
                            AgreementCounts& tally) const {
  std::vector<Hit> hits(fan.grid->rays());
  tracer.trace(fan, faces, hits);
  const refine::Triangles triangles = tracer.triangles();
  for (const BentRay& ray : some) {
    Hit& found = hits[ray.number];
    if (found) tracer.incidence_of(ray.number, found);
    const bool index = !found || (found.index < triangles.faces.size() &&
                                  triangles.number(found.index) == found.face);
    tally.wrong_index += !index;
    const Verdict verdict = index ? judge(ray, found) : Verdict::unexplained;
    tally.add(verdict, {ray.launch, ray.expected, found});
    if (verdict != Verdict::same || !found) continue;
    const double dt_m = std::abs(found.t - ray.expected.t);
    tally.largest_dt_m = std::max(tally.largest_dt_m, dt_m);
    tally.largest_dt_relative = std::max(tally.largest_dt_relative, dt_m / ray.expected.t);
    tally.largest_dt_of_tolerance = std::max(tally.largest_dt_of_tolerance, dt_m / tolerance_m);
  }
}

Verdict BentReference::judge(const BentRay& ray, const Hit& found) const {
  const auto& [number, launch, expected] = ray;
  if (!found && !expected) return Verdict::same;
  const bool both = found && expected;
  const double apart_m = both ? std::abs(found.t - expected.t) : 0.0;
  if (both && found.face == expected.face)
    return apart_m <= tolerance_m ? Verdict::same : Verdict::unexplained;
  if (found && !is_on_face(launch, found)) return Verdict::unexplained;
  if (both && apart_m < reach_m) return Verdict::tie;
  const double t = std::min(found ? found.t : launch.t_max, expected ? expected.t : launch.t_max);
  if (std::abs(t - launch.t_max) < reach_m) return Verdict::end;
  // A corner of a face may fill little of the circle of reach_m about the ray.
  const Vector3d across = launch.direction.unitOrthogonal(), other = launch.direction.cross(across);
  constexpr int ways = 16;
  for (const double share : {1.0, 0.1})
    for (int i = 0; i < ways; ++i) {
      const double turn = 2.0 * std::numbers::pi * i / ways;
      const Vector3d way = std::cos(turn) * across + std::sin(turn) * other;
      Ray beside = launch;
      beside.direction = (launch.direction + share * reach_m / t * way).normalized();
      const Hit hit = trace(beside);
      // At a corner a neighbour of the face is the same place.
      if (hit.face == found.face || (found && hit && std::abs(hit.t - found.t) < 2.0 * reach_m))
        return Verdict::edge;
    }
  return Verdict::unexplained;
}

}  // namespace ensonify::engine
