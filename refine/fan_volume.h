#pragma once

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace ensonify::refine {

/// A solid sphere, local metres.
struct Sphere {
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  float radius = 0.0f;
};

/// The bounded volume of one fan: the points within range of the apex whose direction d has |d .
/// array_axis| <= sin(truncation), an elevation asin(d . pole) between the limits, and d . middle
/// >= 0. The three directions are the fan's orthonormal frame: along the array, towards the middle
/// of the sector, and perpendicular to these two. The limits are within +-90 degrees, the
/// truncation in 0..90.
struct FanVolume {
  Eigen::Vector3d apex = Eigen::Vector3d::Zero();  ///< local metres
  Eigen::Vector3d array_axis = Eigen::Vector3d::UnitX();
  Eigen::Vector3d middle = Eigen::Vector3d::UnitY();
  Eigen::Vector3d pole = Eigen::Vector3d::UnitZ();
  double truncation_rad = 0.0;
  double elevation_low_rad = 0.0;
  double elevation_high_rad = 0.0;
  double range_m = 0.0;
  double margin_m = 0.0;  ///< points within this distance count as inside

  bool operator==(const FanVolume&) const = default;
};

/// Tests whether spheres can touch any of several fan volumes. The test is true for every sphere
/// that touches a volume, and near a volume's edges also for some that do not. It takes the
/// rounding of the rays into account.
class ViewTest {
 public:
  ViewTest() = default;
  explicit ViewTest(std::span<const FanVolume> volumes) { look_at(volumes); }

  /// Replaces the volumes; keeps the memory. Throws std::invalid_argument for a frame that is not
  /// orthonormal, angles out of bounds, a negative range, and values that are not finite.
  void look_at(std::span<const FanVolume> volumes);

  bool touches(const Sphere& sphere) const {
    for (const Bounds& volume : volumes_)
      if (volume.touch(sphere)) return true;
    return false;
  }

  using Corners = std::array<Eigen::Vector3f, 3>;
  /// The same test for a triangle, but with half the margin for rounding. So if a triangle touches
  /// a volume, all spheres around the triangle touch it, too, and the result for a triangle does
  /// not depend on the way in which it was found. This holds if the elevation limits enclose 0. For
  /// volumes that were widened for a motion, the triangle must also be smaller than the range.
  bool touches(const Corners& corners) const {
    for (const Bounds& volume : volumes_)
      if (volume.touch(corners)) return true;
    return false;
  }

 private:
  struct Bounds {
    bool touch(const Sphere& sphere) const;
    bool touch(const Corners& corners) const;

    Eigen::Vector3d apex, axis, middle, pole;
    double cos_truncation, sin2_truncation;
    double cos_low, sin_low, cos_high, sin_high;
    double range_m, slack_m, triangle_slack_m;
  };
  // The direction of a ray in floats has an error of at most 6e-8. A tracer's arithmetic has an
  // error of about ten such steps, relative to the distances that it computes with. These are the
  // range (slack_m) and the face's own size, which is less than its sphere's (this constant).
  static constexpr double slack_of_radius = 4e-6;

  std::vector<Bounds> volumes_;
};

// Compares the radius with the distance from each surface that bounds the volume; none of these
// distances is larger than the distance from the volume itself. Let p be a point relative to the
// apex. Its distance from the cone |p . axis| = |p| sin(truncation) is exactly cos |a| - sin q,
// where q is the distance of p from the axis. Its distance from the cones of the elevation limits,
// whose axis is the pole, is at least the distance from their lines in the plane of p and the pole.
// The function is inline because it is the innermost loop of all refinement.
inline bool ViewTest::Bounds::touch(const Sphere& sphere) const {
  const Eigen::Vector3d p = sphere.centre.cast<double>() - apex;
  const double radius = sphere.radius * (1.0 + slack_of_radius) + slack_m;
  const double a = p.dot(axis), m = p.dot(middle), h = p.dot(pole);
  const double beside = cos_truncation * std::abs(a) - radius;
  if (beside > 0.0 && beside * beside > sin2_truncation * (m * m + h * h)) return false;
  if (m < -radius) return false;
  const double w2 = a * a + m * m, reach = range_m + radius;
  if (w2 + h * h > reach * reach) return false;
  const double w = std::sqrt(w2);
  return h * cos_high - w * sin_high <= radius && w * sin_low - h * cos_low <= radius;
}

}  // namespace ensonify::refine
