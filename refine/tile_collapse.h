#pragma once

#include <functional>

#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

/// Whether vertices at a mesh's border may be collapsed. If they stay, meshes with a common border
/// fit each other at any resolution.
enum class Borders { collapse, stay };

/// The analysis by tiles. The mesh is cut in space into tiles of some thousand vertices. Edges are
/// collapsed inside each tile, those with the smallest closed star first. Then four tiles become
/// one, stage by stage, until there is one tile in which nothing can be collapsed. The tiles of a
/// stage share no vertex that may be touched, so `threads` threads work on them at once. The result
/// depends only on the mesh, because the collapses are ordered by stage and by tile. Takes about
/// 1.5 us per vertex. At the peak it takes tile_collapse_bytes_per_face in addition to the mesh,
/// which includes the 68 bytes per vertex of the result.
///
/// `in` must be finite, manifold and oriented, with or without borders, in any number of components
/// (mesh_repair.h makes it so). Throws MeshError naming a place where it is not, and
/// std::invalid_argument if threads < 1. Unreferenced vertices become separate leaves. Like in
/// edge_collapse.h, only collapses that keep the topology are allowed. `stop_check` is called
/// before each tile, by all threads; its exceptions end the work.
ProgressiveMeshArrays build_by_tiles(const TriangleMesh& in, int threads,
                                     Borders borders = Borders::collapse,
                                     const std::function<void()>& stop_check = {});

/// Does the same for any mesh. Where the mesh is not manifold, vertices are split. Faces keep their
/// places and numbers, so this does not change what rays hit. Faces that are oriented against their
/// neighbours are turned over, so u and v of hits on them change.
ProgressiveMeshArrays build_of_any_mesh(const TriangleMesh& in, int threads,
                                        Borders borders = Borders::collapse,
                                        const std::function<void()>& stop_check = {});

/// Peak memory of build_by_tiles, for a mesh with half as many vertices as faces.
inline constexpr double tile_collapse_bytes_per_face = 75.0;

}  // namespace ensonify::refine
