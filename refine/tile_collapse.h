#pragma once

#include <functional>

#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

/// What becomes of the vertices at a mesh's border. If they stay, meshes that share a border fit
/// each other at any resolution.
enum class Borders { collapse, stay };

/// The analysis phase by tiles. The mesh is cut in space into tiles of some thousand vertices.
/// Edges are collapsed inside each tile, the smallest closed star first; then four tiles become
/// one, stage by stage, until one is left and nothing in it can be collapsed. Tiles of one stage
/// share no vertex that may be touched, so `threads` threads can work on them at once, and the
/// result depends only on the mesh: the collapses are ordered by stage and by tile. Takes about 1.5
/// us per vertex, and at the peak the memory below in addition to the mesh, which includes the
/// result's 68 bytes per vertex.
///
/// `in` must be finite, manifold and oriented, with or without borders, in any number of components
/// (mesh_repair.h makes it so); throws MeshError naming a place where it is not, and
/// std::invalid_argument if threads < 1. Unreferenced vertices become separate leaves. The same
/// collapses are allowed as in edge_collapse.h: all topology is kept. `stop_check` is called before
/// each tile, by all threads; what it throws ends the work.
ProgressiveMeshArrays build_by_tiles(const TriangleMesh& in, int threads,
                                     Borders borders = Borders::collapse,
                                     const std::function<void()>& stop_check = {});

/// The same of any mesh: where it is not manifold, vertices are split. The faces stay where they
/// are and keep their numbers, so no ray sees that. Faces that are oriented against their
/// neighbours are turned over: their u and v change.
ProgressiveMeshArrays build_of_any_mesh(const TriangleMesh& in, int threads,
                                        Borders borders = Borders::collapse,
                                        const std::function<void()>& stop_check = {});

/// Peak memory of build_by_tiles, for a mesh with half as many vertices as faces.
inline constexpr double tile_collapse_bytes_per_face = 75.0;

}  // namespace ensonify::refine
