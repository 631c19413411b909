#pragma once

#include <span>
#include <string>
#include <vector>

#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/progressive_mesh.h>

namespace ensonify::tests {

/// Checks an active mesh: returns, in words, what does not hold although it must after any sequence
/// of splits and collapses; empty if all is well. It applies the definitions to the whole original
/// mesh, which is slow.
///
/// Its vertices' leaves partition all leaves. Its faces are the original ones with three distinct
/// active ancestors. Each directed edge exists at most once; opposites and borders agree; each
/// vertex has one fan. Euler's characteristic is the original's; each vertex stands for a disc. Cut
/// vertices are in the one-ring; where two are one, that one was collapsed later. The exact faces
/// are the faces of three leaves.
std::vector<std::string> broken_invariants(const refine::ActiveMesh& mesh);

/// The same, plus what refine(volumes) promises: no active inner sphere meets a volume, and the
/// exact faces contain Footprint's.
std::vector<std::string> broken_invariants(const refine::ActiveMesh& mesh,
                                           std::span<const refine::FanVolume> volumes);

/// Checks a progressive mesh's spheres: each must contain, in double, every original face that
/// touches a leaf of its node.
std::vector<std::string> broken_invariants(const refine::ProgressiveMesh& mesh);

/// Whether a mesh at full refinement has each face of its source, unchanged.
bool has_all_faces(const refine::ActiveMesh& mesh, const refine::TriangleMesh& source);

}  // namespace ensonify::tests
