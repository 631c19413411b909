#pragma once

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/object_mesh.h>

namespace ensonify::engine {

/// The largest angle between the normals of neighbouring facets, divided by the half width of their
/// material's lobe, for which a body of facets has the echo of the round body within 0.5 dB from
/// every side. (A sum of the lobe exp(-x^2 / s^2) in steps of d differs from its integral by
/// 2 exp(-(pi s / d)^2), relative.)
inline constexpr double facet_over_lobe = 1.9;

/// Faces whose normals differ by less than sharpest_rad approximate a round surface. Faces whose
/// normals differ by less than flattest_rad, which rounding may cause, are one plane.
inline constexpr double sharpest_rad = 40.0 * degree, flattest_rad = 0.05 * degree;

/// The angle between the normals of neighbouring facets where a mesh approximates a round surface:
/// the mean of the angles up to sharpest_rad over all edges, weighted by length and angle. Larger
/// angles are real edges of the body. The result is 0 if real edges turn more (angle times length).
double facet_angle_rad(const ObjectMesh& mesh);

}  // namespace ensonify::engine
