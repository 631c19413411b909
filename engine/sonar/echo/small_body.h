#pragma once

#include <optional>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/objects/object_surface.h>
#include <ensonify/scatter/rigid_body.h>

namespace ensonify::engine {

/// The rigid ellipsoid that stands for an object that is shorter than the waves.
struct SmallBody {
  scatter::RigidBody body;
  Eigen::Matrix3d axes;  ///< columns: unit vectors along body.half_axes_m, which ascend

  /// The cross-section of the body as a whole, if it is smooth. to_sonar: unit vector.
  double cross_section_m2(const Eigen::Vector3d& to_sonar, double wavelength_m) const;
  /// What rough parts of its surface return, divided by what they return in short waves: the ratio
  /// for a sphere that is as wide as the two longer axes.
  double gain(double wavelength_m) const;
};

/// The ellipsoid with the volume of an object and the second moments of this volume. If the surface
/// is open, or its flat parts enclose no volume, the half axes are twice the rms distances of the
/// surface along its principal axes, which is exact for a disc. None if k times the longest half
/// axis is 2 or more.
std::optional<SmallBody> small_body_of(const ObjectSurface& object, bool open, double wavelength_m);

}  // namespace ensonify::engine
