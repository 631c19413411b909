#pragma once

#include <cmath>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace ensonify::refine {

/// A ball, local metres.
struct Sphere {
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  float radius = 0.0f;
};

/// The bounded volume of one fan: the points within range of the apex whose direction d has
/// |d . array_axis| <= sin(truncation), an elevation asin(d . pole) between the limits, and d .
/// middle
/// >= 0. The three directions are the fan's frame, orthonormal: along the array, towards the middle
/// of the sector, and across both. The limits lie within +-90 degrees, the truncation in 0 to 90.
struct FanVolume {
  Eigen::Vector3d apex = Eigen::Vector3d::Zero();  ///< local metres
  Eigen::Vector3d array_axis = Eigen::Vector3d::UnitX();
  Eigen::Vector3d middle = Eigen::Vector3d::UnitY();
  Eigen::Vector3d pole = Eigen::Vector3d::UnitZ();
  double truncation_rad = 0.0;
  double elevation_low_rad = 0.0;
  double elevation_high_rad = 0.0;
  double range_m = 0.0;
  double margin_m = 0.0;  ///< what is this near is taken as inside

  bool operator==(const FanVolume&) const = default;
};

/// Whether balls can touch any of several view volumes: never no where one does, sometimes yes
/// where none does (near the volume's edges), rounding of the rays included.
class ViewTest {
 public:
  ViewTest() = default;
  explicit ViewTest(std::span<const FanVolume> volumes) { look_at(volumes); }

  /// Other volumes from now on; keeps the memory. Throws std::invalid_argument for what no fan is:
  /// a frame that is not orthonormal, angles out of their bounds, a negative range, what is not
  /// finite.
  void look_at(std::span<const FanVolume> volumes);

  bool touches(const Sphere& sphere) const {
    for (const Bounds& volume : volumes_)
      if (volume.touch(sphere)) return true;
    return false;
  }

 private:
  struct Bounds {
    bool touch(const Sphere& sphere) const;

    Eigen::Vector3d apex, axis, middle, pole;
    double cos_truncation, sin2_truncation;
    double cos_low, sin_low, cos_high, sin_high;
    double range_m, slack_m;
  };
  // Floats keep a ray's direction within 6e-8 and a tracer's arithmetic errs by some ten such
  // steps, of the distances that it works with: the range here, the face's own size (below its
  // ball's) there.
  static constexpr double slack_of_radius = 4e-6;

  std::vector<Bounds> volumes_;
};

// By its distance from each of the surfaces that bound the volume, of which every one is at most
// that from the volume itself. Of a point p from the apex: from the cone |p . axis| = |p|
// sin(truncation), exactly cos |a| - sin q with q its distance from the axis; from the cones of the
// limits, whose axis is the pole, at least the distance from their lines in the plane of p and the
// pole. Here and not in the .cpp since this is the inner loop of all refinement.
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
