#pragma once

#include <optional>

#include <Eigen/Core>

#include <ensonify/engine/seafloor/objects/object_surface.h>
#include <ensonify/scatter/rigid_body.h>

namespace ensonify::engine {

/// An object as the rigid ellipsoid that stands for it in sound whose waves are longer than it is.
struct SmallBody {
  scatter::RigidBody body;
  Eigen::Matrix3d axes;  ///< unit columns, as of body.half_axes_m, which rise

  /// Of all of it, if it is smooth. to_sonar: unit.
  double cross_section_m2(const Eigen::Vector3d& to_sonar, double wavelength_m) const;
  /// What rough parts of its surface return, over what they would in shorter waves: as for a sphere
  /// as wide as its two longer axes.
  double gain(double wavelength_m) const;
};

/// The ellipsoid with the volume of an object, and the second moments of that volume. Of an open
/// surface, or one whose flat parts enclose no volume: that whose half axes are twice the rms
/// distances of the surface along its principal axes, exact for a disc. None if k times its longest
/// half axis is 2 or more.
std::optional<SmallBody> small_body_of(const ObjectSurface& object, bool open, double wavelength_m);

}  // namespace ensonify::engine
