#pragma once

#include <cmath>
#include <cstdint>
#include <set>

#include "support/meshes.h"

#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::tests {

/// Whether a point is inside a fan volume, by the definition in fan_volume.h.
inline bool inside(const refine::FanVolume& v, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = point - v.apex;
  const double r = p.norm(), h = p.dot(v.pole);
  return r <= v.range_m && std::abs(p.dot(v.array_axis)) <= r * std::sin(v.truncation_rad) &&
         p.dot(v.middle) >= 0.0 && h >= r * std::sin(v.elevation_low_rad) &&
         h <= r * std::sin(v.elevation_high_rad);
}

/// Faces that touch the volume: a random point of each face is inside.
inline std::set<std::uint32_t> touched_faces(const refine::TriangleMesh& mesh,
                                             const refine::FanVolume& volume, Random& random) {
  std::set<std::uint32_t> out;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    for (int k = 0; k < 12; ++k) {
      double u = uniform(random), v = uniform(random);
      if (k < 3) u = k == 1, v = k == 2;  // the corners
      if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
      const Eigen::Vector3d a = mesh.positions[mesh.faces[f][0]].cast<double>();
      const Eigen::Vector3d b = mesh.positions[mesh.faces[f][1]].cast<double>();
      const Eigen::Vector3d c = mesh.positions[mesh.faces[f][2]].cast<double>();
      if (!inside(volume, a + u * (b - a) + v * (c - a))) continue;
      out.insert(f);
      break;
    }
  return out;
}

}  // namespace ensonify::tests
