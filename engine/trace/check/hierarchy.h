#pragma once

#include <ensonify/engine/trace/check/fan_comparison.h>
#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::engine {

/// Compares every face of a progressive mesh with the mesh it was made from: it has each once, with
/// the same three places in the same order, and the sphere of every node above one of its corners
/// encloses it; so no volume that a face touches can miss it. A face counts as `same`; as `tie` if
/// it is left out since another one has its vertices, as `coplanar` for want of area, which no ray
/// hits; else as unexplained, and twice if a second one has its number. Takes a bit a face of
/// memory. Throws refine::DamagedFile.
AgreementCounts compare_faces(refine::Triangles mesh, const refine::ProgressiveMesh& progressive,
                              int threads);

}  // namespace ensonify::engine
