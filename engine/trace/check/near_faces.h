#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/trace/ray_fan.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// The faces of a mesh that some fans can touch, found without any tree or hierarchy: a face is
/// left out only if it lies beyond one side of the oriented box of every fan. So a check of one
/// ping needs no memory for the whole mesh.
struct NearFaces {
  /// The vertices they use, in their order in the mesh: so edges run the same way, and the
  /// reference gives the same bits as over the whole mesh.
  std::vector<Eigen::Vector3f> positions;
  std::vector<refine::Face> faces;
  std::vector<std::uint32_t> numbers;  ///< of the faces in the mesh, ascending

  /// Reads all faces once. Faces that name a vertex which is not there, as the empty slots of a
  /// progressive mesh do, are none.
  NearFaces(refine::Triangles mesh, std::span<const RayFan> fans);

  /// Puts a triangle behind them, with a number above all others.
  void add(const std::array<Eigen::Vector3f, 3>& corners, std::uint32_t number);

  refine::Triangles triangles() const { return {positions, faces, numbers}; }
};

}  // namespace ensonify::engine
