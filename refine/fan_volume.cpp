#include <ensonify/refine/fan_volume.h>

#include <algorithm>
#include <numbers>
#include <stdexcept>

#include <Eigen/Geometry>

namespace ensonify::refine {
namespace {

// Margins for rounding that do not depend on the radius of a sphere. For directions and for the
// arithmetic of a tracer: about a hundred steps of a float as large as the range, at least 1 mm.
// For the origin of rays: one step of a float as large as the origin's coordinates.
constexpr double slack_of_range = 1e-5;
constexpr double slack_of_origin = 2e-7;
constexpr double min_slack_m = 1e-3;

void check_volume(const FanVolume& volume) {
  Eigen::Matrix3d frame;
  frame << volume.array_axis, volume.middle, volume.pole;
  constexpr double right_angle = std::numbers::pi / 2.0;
  // Written with `!`, so that NaN fails.
  if (!((frame.transpose() * frame).isIdentity(1e-9) && volume.apex.allFinite()))
    throw std::invalid_argument("FanVolume: the frame must be orthonormal and the apex finite");
  if (!(volume.truncation_rad >= 0.0 && volume.truncation_rad <= right_angle &&
        volume.elevation_low_rad >= -right_angle && volume.elevation_high_rad <= right_angle &&
        volume.elevation_low_rad <= volume.elevation_high_rad))
    throw std::invalid_argument(
        "FanVolume: truncation must be in 0 to 90 degrees, elevations in order within +-90");
  if (!(volume.range_m >= 0.0 && std::isfinite(volume.range_m)))
    throw std::invalid_argument("FanVolume: the range must be finite and not negative");
}

/// The squared least distance from the origin to a triangle.
double least_distance_m2(const std::array<Eigen::Vector3d, 3>& corners) {
  const auto& [a, b, c] = corners;
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  double least_m2 = a.squaredNorm();
  bool beneath = normal.squaredNorm() > 0.0;  // whether the origin projects into the triangle
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d &from = corners[k], edge = corners[(k + 1) % 3] - from;
    const double share = std::clamp(-from.dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    if (share > 0.0) least_m2 = std::min(least_m2, (from + share * edge).squaredNorm());
    beneath = beneath && normal.dot(from.cross(edge)) >= 0.0;
  }
  return beneath ? std::pow(normal.dot(a), 2) / normal.squaredNorm() : least_m2;
}

}  // namespace

void ViewTest::look_at(std::span<const FanVolume> volumes) {
  volumes_.clear();
  for (const FanVolume& v : volumes) {
    check_volume(v);
    const double sin_truncation = std::sin(v.truncation_rad);
    const double rounding_m = std::max(min_slack_m, slack_of_range * v.range_m) +
                              slack_of_origin * v.apex.lpNorm<Eigen::Infinity>();
    volumes_.push_back({.apex = v.apex,
                        .axis = v.array_axis,
                        .middle = v.middle,
                        .pole = v.pole,
                        .cos_truncation = std::cos(v.truncation_rad),
                        .sin2_truncation = sin_truncation * sin_truncation,
                        .cos_low = std::cos(v.elevation_low_rad),
                        .sin_low = std::sin(v.elevation_low_rad),
                        .cos_high = std::cos(v.elevation_high_rad),
                        .sin_high = std::sin(v.elevation_high_rad),
                        .range_m = v.range_m,
                        .slack_m = v.margin_m + rounding_m,
                        .triangle_slack_m = v.margin_m + 0.5 * rounding_m});
  }
}

// Uses the same distances as the test of a sphere. If a point of the triangle is inside the volume,
// then for each sphere around the point, each distance is at most the sphere's radius. This also
// holds if the points that are inside differ from surface to surface. The distances from the cones
// are concave on the outer side, which is convex. So a triangle is outside if all its corners are
// outside, for the cones of the beam on the same side.
bool ViewTest::Bounds::touch(const Corners& corners) const {
  bool left = true, right = true, behind = true;
  bool above = sin_high >= 0.0, below = sin_low <= 0.0;  // otherwise the inner side is convex
  bool within = false;
  const double reach = range_m + triangle_slack_m, reach2 = reach * reach;
  std::array<Eigen::Vector3d, 3> points;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& p = points[k] = corners[k].cast<double>() - apex;
    const double a = p.dot(axis), m = p.dot(middle), h = p.dot(pole);
    const double beside = cos_truncation * std::abs(a) - triangle_slack_m;
    const bool outside = beside > 0.0 && beside * beside > sin2_truncation * (m * m + h * h);
    left = left && outside && a < 0.0;
    right = right && outside && a > 0.0;
    behind = behind && m < -triangle_slack_m;
    const double w2 = a * a + m * m, w = std::sqrt(w2);
    above = above && h * cos_high - w * sin_high > triangle_slack_m;
    below = below && w * sin_low - h * cos_low > triangle_slack_m;
    within = within || w2 + h * h <= reach2;
  }
  if (left || right || behind || above || below) return false;
  return within || least_distance_m2(points) <= reach2;
}

}  // namespace ensonify::refine
