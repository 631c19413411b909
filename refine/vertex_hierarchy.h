#pragma once

#include <cstdint>
#include <span>

#include <ensonify/refine/progressive_mesh.h>

namespace ensonify::refine {

/// One collapse as a builder records it: two vertices became one, which has the number `kept`.
struct Collapse {
  std::uint32_t kept;     ///< source vertex; right child of the node that stands for both
  std::uint32_t removed;  ///< source vertex; left child
  /// The source faces that vanished on the left and on the right of the edge from `removed` to
  /// `kept`; `none` at a border.
  std::uint32_t left_face = ProgressiveMesh::none;
  std::uint32_t right_face = ProgressiveMesh::none;
};

/// Builds the hierarchy of a sequence of collapses (finest first) over a mesh: the order of leaves,
/// the fundamental faces, and the spheres around closed stars, enlarged because of rounding. Takes
/// less than a microsecond per vertex. The number of threads does not change the result. Throws
/// std::invalid_argument if a collapse has a vertex that does not exist (any more), or a face that
/// does not exist or was removed before; for a face with a vertex that does not exist, for 2^31
/// vertices or more, and for threads < 1.
ProgressiveMeshArrays lay_out(const TriangleMesh& mesh, std::span<const Collapse> collapses,
                              int threads = 1);

}  // namespace ensonify::refine
