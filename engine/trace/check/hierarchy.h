#pragma once

#include <ensonify/engine/trace/check/fan_comparison.h>
#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Compares a progressive mesh with the mesh it was made from. The progressive mesh must have each
/// face once, with the same three positions in the same order. The sphere of every node above a
/// corner of a face must enclose the face, so that no volume that touches the face can miss it. A
/// face counts as `same`; as `tie` if it is left out because another face has its vertices; as
/// `coplanar` if it is left out because it has no area (no ray hits it); otherwise as unexplained.
/// A second face with the same number counts as unexplained once more. Needs one bit of memory per
/// face. Throws refine::DamagedFile.
AgreementCounts compare_faces(refine::Triangles mesh, const refine::ProgressiveMesh& progressive,
                              int threads);

}  // namespace ensonify::engine
