#pragma once

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/object_mesh.h>

namespace ensonify::engine {

/// The largest angle between the normals of neighbouring facets, divided by the half width of their
/// material's lobe, at which a faceted round body has the echo of the round body within 0.5 dB from
/// every side. (Facets at steps of d sum the lobe exp(-x^2 / s^2) to its integral with a relative
/// error of 2 exp(-(pi s / d)^2).)
inline constexpr double facet_over_lobe = 1.9;

/// Faces that meet at less than the sharpest of these angles approximate a round surface; at less
/// than the flattest, which rounding may cause, they are one plane.
inline constexpr double sharpest_rad = 40.0 * degree, flattest_rad = 0.05 * degree;

/// The angle between the normals of neighbouring facets where a mesh approximates a round surface:
/// the mean over its edges, weighted by length and angle, of the angles up to the sharpest. Larger
/// angles are taken for real edges of the body; if these contribute most of the turning, the result
/// is 0.
double facet_angle_rad(const ObjectMesh& mesh);

}  // namespace ensonify::engine
