#pragma once

#include <span>
#include <string>
#include <vector>

#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/fan_volume.h>
#include <ensonify/refine/progressive_mesh.h>

namespace ensonify::refine {

/// What does not hold of an active mesh although it must after any sequence of splits and
/// collapses, in words; empty where all is well. Found by the definitions over the whole original
/// mesh, which is slow: for tests and soak runs.
///
/// Its vertices' leaves partition all leaves; its faces are the original ones with three distinct
/// active ancestors; each directed edge is there at most once, opposites and borders agree and each
/// vertex has one fan; Euler's characteristic is the original's; each vertex stands for a disc; cut
/// vertices are in the one-ring, and where both are one that was collapsed later; the exact faces
/// are those of three leaves.
std::vector<std::string> broken_invariants(const ActiveMesh& mesh);

/// What does not hold, of the above and of what refine(volumes) promises: no active inner sphere
/// meets a volume, and the exact faces contain Footprint's.
std::vector<std::string> broken_invariants(const ActiveMesh& mesh,
                                           std::span<const FanVolume> volumes);

/// What does not hold of a progressive mesh's spheres: each contains, in double, every original
/// face that touches a leaf of its node.
std::vector<std::string> broken_invariants(const ProgressiveMesh& mesh);

}  // namespace ensonify::refine
