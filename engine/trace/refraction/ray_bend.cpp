#include <ensonify/engine/trace/refraction/ray_bend.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace ensonify::engine {

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
