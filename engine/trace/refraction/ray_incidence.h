#pragma once

#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include <ensonify/engine/trace/ray.h>

namespace ensonify::engine {

/// The horizontal direction of a vector, unit; x where it is vertical.
inline Eigen::Vector2d horizontal(const Eigen::Vector3d& direction) {
  const Eigen::Vector2d level = direction.head<2>();
  const double length = level.norm();
  return length > 0.0 ? Eigen::Vector2d(level / length) : Eigen::Vector2d::UnitX();
}

/// How the sound of a ray arrives at its hit.
///
/// An echo treats a bent ray as a straight ray of the same launch direction, whose length is the
/// travel time at one reference speed: the ray in straightened space (StraightenedSpace). That
/// space stretches the sea around the hit a little, by one factor for each of three directions.
struct RayIncidence {
  Eigen::Vector3d place;      ///< of the hit, local metres
  Eigen::Vector3d direction;  ///< of travel at the hit, unit
  double spreading_m2;        ///< of the way back: SoundRay::spreading_back_m2
  double absorption_db;       ///< one way
  // Metres of the sea for one metre of straightened space: along the ray, across it in its vertical
  // plane (negative where the ray has crossed its neighbours, behind a caustic), and across it
  // horizontally.
  double along, upwards, sideways;
  // Radians by which the direction of the rays turns over one metre of straightened space: upwards
  // over a metre along the ray, upwards over a metre across it, and sideways over a metre across it
  // horizontally.
  double turn_along, turn_upwards, turn_sideways;
  /// By how much a normal along the ray turns upwards in straightened space. A bent ray runs in the
  /// direction in which travel time grows fastest, so the value is 0; a straight ray (TravelTime)
  /// does not run in this direction.
  double upturn = 0.0;

  /// The unit normal that a facet at the hit has in straightened space, from its unit normal in the
  /// sea and the ray's launch direction.
  Eigen::Vector3d straightened(const Eigen::Vector3d& normal, const Eigen::Vector3d& launch) const;
  /// A small step from the hit, in the sea.
  struct Step {
    Eigen::Vector3d displacement;  ///< m
    Eigen::Vector3d turn;          ///< change of `direction`
  };
  /// Converts a small step (m) at the hit from straightened space to the sea. A step along a facet
  /// in straightened space becomes a step along the facet in the sea.
  Step in_sea(const Eigen::Vector3d& step, const Eigen::Vector3d& launch) const;
};

/// The ray that leads from the sonar to a place, and how sound arrives there.
struct RayToPlace {
  Eigen::Vector3d launch;  ///< unit
  /// Vector (m) from the sonar to the place as if a straight ray arrived there with this direction
  /// and this spreading. The square of its length is J, the geometric mean of the spreading of both
  /// ways.
  Eigen::Vector3d apparent;
  double range_m;        ///< travel time times the reference speed
  double absorption_db;  ///< one way
};

/// Computes how rays arrive at their hits and at other places, one by one, because an echo asks for
/// few of them.
class IncidenceSource {
 public:
  virtual ~IncidenceSource() = default;
  /// The ray from an origin to a place `away` from it; none in a shadow zone.
  virtual std::optional<RayToPlace> ray_to(const Eigen::Vector3d& origin,
                                           const Eigen::Vector3d& away) const = 0;
  /// How a ray of the fan that was traced last arrives, by its number. `hit` is its hit as the
  /// tracer left it. Makes the t of the hit exact; before, it may be off by half a millimetre. (u
  /// and v of the hit may belong to a part of the face.)
  virtual RayIncidence incidence_of(std::size_t number, Hit& hit) = 0;
};

}  // namespace ensonify::engine
