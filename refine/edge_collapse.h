#pragma once

#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::refine {

/// The analysis with OpenMesh: collapses edges in order of their quadric error (Garland & Heckbert
/// 1997) if OpenMesh's is_collapse_ok allows it, and records what each collapse removed. This is
/// the reference builder: slow (about 20 us per face), for meshes of up to some million faces.
///
/// `mesh` must be manifold and oriented (mesh_repair.h makes it so), with or without borders, in
/// any number of components. Throws MeshError naming the first place where it is not. Unreferenced
/// vertices become separate leaves. The result depends only on the mesh.
ProgressiveMeshArrays build_by_edge_collapse(const TriangleMesh& mesh);

}  // namespace ensonify::refine
