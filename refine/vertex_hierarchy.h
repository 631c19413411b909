#pragma once

#include <cstdint>
#include <span>

#include <ensonify/refine/progressive_mesh.h>

namespace ensonify::refine {

/// One collapse as a builder saw it: two vertices became one that keeps the name of the first.
struct Collapse {
  std::uint32_t kept;     ///< source vertex; right child of the node that stands for both
  std::uint32_t removed;  ///< source vertex; left child
  /// The source faces that vanished, or none: to the left of the edge removed -> kept, and to its
  /// right.
  std::uint32_t left_face = ProgressiveMesh::none;
  std::uint32_t right_face = ProgressiveMesh::none;
};

/// Lays out the hierarchy that a sequence of collapses (the first is the finest) makes over a mesh:
/// ranks, fundamental faces, and spheres around closed stars, inflated against rounding. Takes less
/// than a microsecond a vertex, on `threads` threads, which change nothing in the result. Throws
/// std::invalid_argument for a sequence that names a vertex that is not there or no longer, or a
/// face that is not there or twice, for a face whose vertex is not there, for 2^31 vertices or
/// more, and for threads < 1.
ProgressiveMeshArrays lay_out(const TriangleMesh& mesh, std::span<const Collapse> collapses,
                              int threads = 1);

}  // namespace ensonify::refine
