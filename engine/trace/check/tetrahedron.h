#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <Eigen/Geometry>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/trace/check/near_faces.h>
#include <ensonify/engine/trace/face_sources/faces_with_bodies.h>
#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// A tetrahedron in the water, made of one body per triangle, so that each triangle has its own
/// body number.
struct Tetrahedron {
  std::array<refine::TriangleMesh, 4> faces;
  Eigen::Isometry3d place;

  /// At a random place on a ray of the fan, before the ray's hit. `hits` are the fan's, by ray
  /// number.
  Tetrahedron(const RayFan& fan, std::span<const Hit> hits, const RandomStream& stream);
};

/// Adds the tetrahedra to a face source that has no bodies yet.
void add_bodies(std::span<const Tetrahedron> bodies, FacesWithBodies& surface);
/// Puts them in the place of as many others: most bodies move, every third is removed and added
/// again.
void replace_bodies(std::span<const Tetrahedron> bodies, FacesWithBodies& surface);

/// Appends their triangles with the numbers from `number` on, which must be above all others.
void append(std::span<const Tetrahedron> bodies, std::uint32_t number, NearFaces& near);

}  // namespace ensonify::engine
