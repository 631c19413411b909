#pragma once

#include <memory>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Embree's tree over the triangles, built once, robust; fans go through it in packets of 16
/// neighbouring elevations of one plane. In float: distances are good to some 1e-6 of themselves, and
/// rays aimed exactly at a vertex slip through once in some hundreds. The instruction set is pinned (AVX2
/// where the machine has it, else SSE 4.2), so that machines agree to the bit.
std::unique_ptr<Intersector> make_embree(refine::Triangles triangles);

}  // namespace ensonify::engine
