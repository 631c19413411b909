#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// The faces of a mesh that some fans can touch, found without a tree or hierarchy. A face is left
/// out only if it lies beyond one side of the oriented box of every fan. So a check of one ping
/// needs no memory for the whole mesh.
struct NearFaces {
  /// The vertices that the faces use, in the mesh's order: so edges run the same way, and the
  /// reference gives the same bits as over the whole mesh.
  std::vector<Eigen::Vector3f> positions;
  std::vector<refine::Face> faces;
  std::vector<std::uint32_t> numbers;  ///< of the faces in the mesh, ascending

  /// Reads all faces once. Skips faces with a vertex that does not exist, which mark the empty
  /// places of a progressive mesh.
  NearFaces(refine::Triangles mesh, std::span<const RayFan> fans);

  /// Appends a triangle. Its number must be above all others.
  void add(const std::array<Eigen::Vector3f, 3>& corners, std::uint32_t number);

  refine::Triangles triangles() const { return {positions, faces, numbers}; }
};

}  // namespace ensonify::engine
