#include <ensonify/engine/trace/refraction/bent_ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

#include <ensonify/engine/base/units.h>
#include <ensonify/scatter/sound_ray.h>

namespace ensonify::engine {
namespace {

constexpr double quiet_nan = std::numeric_limits<double>::quiet_NaN();
constexpr double highest_rad = std::numbers::pi / 3.0;  // above the horizontal
constexpr double node_rad = 0.1 * degree;               // as find_eigenray() shoots
constexpr double closest_rad = 2e-6;                    // of two launch angles
constexpr double needed_times = 4.0;                    // FanGrid needs ranges up to this multiple
// Each edge of a layer needs separate rays, which cross all other edges.
constexpr std::size_t most_layers = 2000;  // above the bed

/// The profile that rays follow. A dense profile is replaced by its means over equal depths.
scatter::SoundSpeedProfile followed(const scatter::SoundSpeedProfile& profile, double bed_m) {
  if (profile.layer_index(bed_m) <= most_layers) return profile;
  std::vector<scatter::SoundSpeedSample> means;
  std::size_t cell = 0;
  double samples = 0.0;
  for (const scatter::SoundSpeedLayer& layer : std::span(profile.layers()).subspan(1)) {
    const auto its_cell =
        static_cast<std::size_t>(layer.top_m / bed_m * static_cast<double>(most_layers));
    if (means.empty() || its_cell != cell) {
      means.emplace_back();
      samples = 0.0;
    }
    cell = its_cell;
    samples += 1.0;
    scatter::SoundSpeedSample& mean = means.back();
    mean.depth_m += (layer.top_m - mean.depth_m) / samples;
    mean.sound_speed_mps += (layer.top_mps - mean.sound_speed_mps) / samples;
  }
  return scatter::SoundSpeedProfile(std::move(means));
}

/// The slant range by travel time, divided by the height. Not a number if the ray meets the surface
/// first; infinite if the ray is longer than needed.
double range_over_height(const scatter::SoundSpeedProfile& profile, const BentWay& way,
                         double depression_rad) {
  const double bed_m = way.source_depth_m + way.height_m;
  scatter::SoundRay ray(profile, way.source_depth_m, std::abs(std::cos(depression_rad)),
                        std::sin(depression_rad), 0.0, bed_m);
  const double longest_s = needed_times * way.range_m / way.reference_mps;
  while (ray.reflections() == 0) {
    const double edge_m = ray.path_to_edge_m();
    if (!std::isfinite(edge_m) || ray.point().time_s > longest_s)
      return std::numeric_limits<double>::infinity();
    ray.advance(edge_m);
  }
  if (ray.point().depth_m < 0.5 * bed_m) return quiet_nan;
  return way.reference_mps * ray.point().time_s / way.height_m;
}

/// Launch angles to begin with, the steepest first: between them a ray's range changes steadily,
/// except at the angles at which it grazes the edge of a layer; these angles are included.
std::vector<double> first_depressions_rad(const scatter::SoundSpeedProfile& profile,
                                          const BentWay& way) {
  std::vector<double> depressions{0.5 * std::numbers::pi};
  for (double d = 0.5 * std::numbers::pi - node_rad; d > -highest_rad; d -= node_rad)
    depressions.push_back(d);
  const double source_mps = profile.speed_mps(way.source_depth_m);
  for (const scatter::SoundSpeedLayer& layer : profile.layers()) {
    if (layer.bottom_mps <= source_mps) continue;
    const double grazes_rad = std::acos(source_mps / layer.bottom_mps);
    for (const double sign : {-1.0, 1.0})
      for (const double beside_rad : {-closest_rad, closest_rad})
        depressions.push_back(sign * grazes_rad + beside_rad);
  }
  std::ranges::sort(depressions, std::greater());
  return depressions;
}

}  // namespace

// Snell: from water of speed c, a ray at an angle a turns where the speed is c / cos(a).
LaunchLimits launch_limits(const scatter::SoundSpeedProfile& profile, double source_depth_m,
                           double bed_depth_m) {
  const double source_mps = profile.speed_mps(source_depth_m);
  double fastest_above_mps = std::max(source_mps, profile.speed_mps(0.0)),
         fastest_below_mps = std::max(source_mps, profile.speed_mps(bed_depth_m));
  for (const scatter::SoundSpeedLayer& layer : std::span(profile.layers()).subspan(1)) {
    if (layer.top_m >= bed_depth_m) break;
    double& fastest_mps = layer.top_m < source_depth_m ? fastest_above_mps : fastest_below_mps;
    fastest_mps = std::max(fastest_mps, layer.top_mps);
  }
  const double grazing_rad = std::acos(source_mps / fastest_below_mps);
  return {grazing_rad, std::max(grazing_rad, std::acos(source_mps / fastest_above_mps))};
}

BentRanges bent_ranges(const scatter::SoundSpeedProfile& cast, const BentWay& way) {
  const scatter::SoundSpeedProfile profile = followed(cast, way.source_depth_m + way.height_m);
  const double needed = way.range_m / way.height_m;
  // The quantity that changes evenly from entry to entry: the range, with coarser steps beyond the
  // needed range.
  const auto steps = [&](double range) {
    const double share = range / needed;
    return 400.0 * std::min(share, 1.0) + 50.0 * std::clamp(share - 1.0, 0.0, needed_times - 1.0);
  };
  const auto at = [&](double depression_rad) {
    return LaunchRange{depression_rad, range_over_height(profile, way, depression_rad)};
  };
  std::vector<LaunchRange> made, ahead;  // those to come, the next one last
  const std::vector<double> first = first_depressions_rad(profile, way);
  std::transform(first.rbegin(), first.rend(), std::back_inserter(ahead), at);
  made.push_back(ahead.back());
  ahead.pop_back();
  while (!ahead.empty()) {
    const LaunchRange from = made.back(), to = ahead.back();
    const double apart_rad = from.depression_rad - to.depression_rad;
    const bool no_bed = std::isnan(from.range_over_height),
               then_none = std::isnan(to.range_over_height);
    const double apart =
        no_bed || then_none ? 0.0
                            : std::abs(steps(to.range_over_height) - steps(from.range_over_height));
    if ((no_bed != then_none || apart > 1.0) && apart_rad > closest_rad) {
      ahead.push_back(at(0.5 * (from.depression_rad + to.depression_rad)));
      continue;
    }
    if (apart > 2.0)  // no ray has a range in between
      made.push_back({0.5 * (from.depression_rad + to.depression_rad), quiet_nan});
    made.push_back(to);
    ahead.pop_back();
  }
  return {std::move(made),
          launch_limits(profile, way.source_depth_m, way.source_depth_m + way.height_m)};
}

// Over a path, a ray's tangent turns by the curvature times the path. The curvature is at most the
// steepest gradient over the slowest speed. By Snell's law the tangent also turns by no more than
// twice the angle at which the fastest speed turns a ray: from one side of the horizontal to the
// other. A point of the ray is the sum of its tangents, so its direction from the origin keeps to
// that angle too; its distance is at least the path times the angle's cosine, and its horizontal
// part is at most the path times the horizontal part of the most level tangent.
FanBend bend_of(const scatter::SoundSpeedProfile& profile, double deepest_m, double range_m,
                double reference_mps) {
  double slowest_mps = std::numeric_limits<double>::infinity(), fastest_mps = 0.0,
         steepest_per_s = 0.0;
  for (const scatter::SoundSpeedLayer& layer : profile.layers()) {
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
