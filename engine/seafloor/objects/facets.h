#pragma once

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// How far apart the normals of neighbouring facets may be, over the half width of their material's
/// lobe, that something round has its own echo within 0.5 dB from every side. (Facets at steps of d
/// sum the lobe exp(-x^2 / s^2) to its integral but for 2 exp(-(pi s / d)^2).)
inline constexpr double facet_over_lobe = 1.9;

/// The angle between the normals of neighbouring facets where a mesh stands for something round:
/// the mean over its edges, by length and angle, of those below 40 degrees. Sharper ones are taken
/// for edges of the thing itself; 0 where most of what turns the surface is those.
double facet_angle_rad(refine::Triangles triangles);

}  // namespace ensonify::engine
