#pragma once

#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

/// The analysis phase by tiles: the mesh is cut in space into tiles of some thousand vertices,
/// edges are collapsed inside each, the smallest closed star first, and then four tiles become one,
/// stage by stage, until one is left and nothing in it can be collapsed. Tiles of one stage share
/// no vertex that may be touched, so that they are done at once, by `threads` threads, and the
/// result depends on the mesh alone: the collapses' order is stage by stage and tile by tile. Takes
/// some 1.5 us a vertex, and at the peak the bytes below beside the mesh, the result's 68 a vertex
/// among them.
///
/// `in` must be finite, manifold and oriented, with or without borders, in any number of components
/// (mesh_repair.h makes it so); throws MeshError naming a place where it is not, and
/// std::invalid_argument if threads < 1. Unreferenced vertices become leaves of their own. What may
/// collapse is as in edge_collapse.h: all topology is kept.
ProgressiveMeshArrays build_by_tiles(const TriangleMesh& in, int threads);

inline constexpr double tile_collapse_bytes_per_face = 75.0;  ///< of half as many vertices

}  // namespace ensonify::refine
