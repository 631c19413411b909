#include <ensonify/scatter/eigenray.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <ensonify/scatter/angle.h>

namespace ensonify::scatter {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double step_rad = 0.1 * degree;
constexpr int max_arcs = 1000000;  // a ray with more arcs oscillates about a duct's axis

struct Launch {
  double along, down;
  bool operator==(const Launch&) const = default;
};

/// The middle of two directions; computed with vectors, which keep a small component precise.
Launch middle(const Launch& a, const Launch& b) {
  const double along = a.along + b.along, down = a.down + b.down;
  const double length = std::hypot(along, down);
  return {along / length, down / length};
}

class Shooter {
 public:
  Shooter(const SoundSpeedProfile& profile, const EigenrayEnds& ends)
      : profile_(profile), ends_(ends) {}

  struct Shot {
    Launch launch;
    double below_m;  ///< depth at the target's range minus the target's depth; infinite at a wall
    double time_s;
  };

  Shot shoot(const Launch& launch) const {
    SoundRay ray = start(launch);
    for (int arcs = 0; arcs < max_arcs; ++arcs) {
      const double path_m = ray.path_to_range_m(ends_.range_m);
      const double edge_m = ray.path_to_edge_m();
      const double down = ray.point().down;
      if (path_m <= edge_m && path_m < inf) {
        ray.advance(path_m);
        return {launch, ray.point().depth_m - ends_.depth_m, ray.point().time_s};
      }
      if (edge_m == inf) return {launch, down > 0.0 ? inf : -inf, inf};
      ray.advance(edge_m);
      if (ray.reflections() > 0) return {launch, ray.point().down < 0.0 ? inf : -inf, inf};
    }
    return {launch, std::nan(""), inf};
  }

  /// The ray that meets the target, between two rays that pass the target on different sides. Its
  /// time is infinite if the depth jumps between the two, so that no ray meets the target.
  Shot between(Shot a, Shot b) const {
    for (int i = 0; i < 2000; ++i) {
      const Shot between = shoot(middle(a.launch, b.launch));
      if (between.launch == a.launch || between.launch == b.launch) break;
      ((between.below_m > 0.0) == (a.below_m > 0.0) ? a : b) = between;
    }
    const Shot& nearest = std::abs(a.below_m) < std::abs(b.below_m) ? a : b;
    const double tolerance_m = 1e-6 + 1e-9 * ends_.range_m;
    return std::abs(nearest.below_m) <= tolerance_m ? nearest : Shot{nearest.launch, inf, inf};
  }

  SoundRay start(const Launch& launch) const {
    return {profile_,    ends_.source_depth_m, launch.along,
            launch.down, ends_.surface_m,      ends_.bottom_m};
  }

 private:
  const SoundSpeedProfile& profile_;
  const EigenrayEnds& ends_;
};

/// The directions to shoot in, ascending in angle, with straight up and straight down.
std::vector<Launch> launches(const SoundSpeedProfile& profile, const EigenrayEnds& ends) {
  constexpr double right_angle = 0.5 * std::numbers::pi;
  std::vector<double> angles_rad;
  const int steps = static_cast<int>(std::round(right_angle / step_rad));
  for (int i = 1 - steps; i < steps; ++i) angles_rad.push_back(i * step_rad);
  const double source_mps = profile.speed_mps(ends.source_depth_m);
  const auto graze = [&](double depth_m) {
    const double cosine = source_mps / profile.speed_mps(depth_m);
    if (!(cosine < 1.0)) return;
    for (const double sign : {-1.0, 1.0}) angles_rad.push_back(sign * std::acos(cosine));
  };
  for (const SoundSpeedLayer& layer : profile.layers())
    if (layer.top_m > ends.surface_m && layer.top_m < ends.bottom_m) graze(layer.top_m);
  for (const double wall_m : {ends.surface_m, ends.bottom_m})
    if (std::isfinite(wall_m)) graze(wall_m);
  std::ranges::sort(angles_rad);
  std::vector<Launch> all = {{0.0, -1.0}};
  for (const double rad : angles_rad) all.push_back({std::cos(rad), std::sin(rad)});
  all.push_back({0.0, 1.0});
  return all;
}

}  // namespace

std::optional<SoundRay> find_eigenray(const SoundSpeedProfile& profile, const EigenrayEnds& ends) {
  if (!(ends.range_m > 0.0 && std::isfinite(ends.range_m)))
    throw std::invalid_argument("find_eigenray: the range must be above 0");
  for (const double depth_m : {ends.source_depth_m, ends.depth_m})
    if (!(std::isfinite(depth_m) && depth_m >= ends.surface_m && depth_m <= ends.bottom_m))
      throw std::invalid_argument("find_eigenray: both ends must lie between surface and bottom");

  const Shooter shooter(profile, ends);
  Shooter::Shot first{{}, inf, inf};
  const auto take = [&](const Shooter::Shot& shot) {
    if (shot.time_s < first.time_s) first = shot;
  };
  std::optional<Shooter::Shot> last;
  for (const Launch& launch : launches(profile, ends)) {
    const Shooter::Shot shot = shooter.shoot(launch);
    if (shot.below_m == 0.0) take(shot);
    if (last && last->below_m * shot.below_m < 0.0) take(shooter.between(*last, shot));
    last = shot;
  }
  if (first.time_s == inf) return std::nullopt;
  return shooter.start(first.launch);
}

// Each round follows a ray to its end near the target. Then the target is `ahead` along the ray's
// direction there, and `aside` below it. A turn of aside / q at the launch brings the ray nearer to
// the target, as long as the new ray is between rays that pass the target on different sides.
std::optional<ArrivedRay> find_near_eigenray(const SoundSpeedProfile& profile,
                                             const EigenrayEnds& ends) {
  constexpr double right_angle = 0.5 * std::numbers::pi, widest_step_rad = 0.1;
  constexpr double close_m = 1e-6;
  constexpr int max_rounds = 30;
  double highest_rad = -right_angle, lowest_rad = right_angle;  // below the level
  const double below_m = ends.depth_m - ends.source_depth_m;
  double angle_rad = std::atan2(below_m, ends.range_m);
  double path_m = std::hypot(ends.range_m, below_m);
  for (int round = 0; round < max_rounds; ++round) {
    const double along = std::cos(angle_rad), down = std::sin(angle_rad);
    SoundRay ray(profile, ends.source_depth_m, along, down, ends.surface_m, ends.bottom_m);
    double left_m = path_m;
    for (double edge_m; (edge_m = ray.path_to_edge_m()) <= left_m; left_m -= edge_m)
      ray.advance(edge_m);
    ray.advance(left_m);
    const SoundRayPoint& at = ray.point();
    const double out_m = ends.range_m - at.range_m, deeper_m = ends.depth_m - at.depth_m;
    const double ahead_m = out_m * at.along + deeper_m * at.down;
    const double aside_m = deeper_m * at.along - out_m * at.down;
    const double turn_rad = aside_m / ray.spread_m();
    if (ray.reflections() > 0 || !std::isfinite(turn_rad)) return std::nullopt;
    if (std::abs(ahead_m) < close_m && std::abs(aside_m) < close_m)
      return ArrivedRay{along, down, ray};
    path_m = std::max(path_m + ahead_m, 0.0);
    (aside_m > 0.0 ? highest_rad : lowest_rad) = angle_rad;
    angle_rad += std::clamp(turn_rad, -widest_step_rad, widest_step_rad);
    if (!(angle_rad > highest_rad && angle_rad < lowest_rad))
      angle_rad = 0.5 * (highest_rad + lowest_rad);
  }
  return std::nullopt;
}

}  // namespace ensonify::scatter
