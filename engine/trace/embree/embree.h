#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Embree's tree over the triangles; fans go through it in packets of neighbouring elevations of
/// one plane, as many as the instruction set takes at once (16 with AVX-512, 8 with AVX, else 4).
///
/// In float: distances are good to some 1e-6 of the range, however far from the mesh's origin, for
/// rays whose origins are floats (nearest_floats.h), as a sonar's fans' are; other origins are
/// rounded to floats. Vertices within 1e9 m, build() refuses others. Robust, a ray aimed exactly at
/// a vertex slips through once in some hundreds; fast (not robust), one in six of those aimed at
/// vertices or edges does, and of two faces at one distance either may win. A ray within a face's
/// plane, as far as float can tell, may be said to hit it, even a little beside it, at a distance
/// that means nothing (`ensonify check` counts such as coplanar). The last bits depend on the
/// instruction set. They do not depend on the tree, but for one case: packets also test faces whose
/// box a ray misses, so a face that the ray passes outside of within rounding may be hit in one
/// tree and missed in another.
///
/// A tree for many pings shares the triangles' memory, so they must not change while it lives; one
/// for one ping copies them, is built in the calling thread, and traces as well but for some
/// percent.
///
/// Throws std::invalid_argument for an instruction set that is not there, std::runtime_error where
/// Embree makes no device.
std::unique_ptr<Intersector> make_embree(const IntersectorOptions& options);

/// The same, ray by ray: shows what packets bring.
std::unique_ptr<Intersector> make_embree_single(const IntersectorOptions& options);

/// The instruction sets that IntersectorOptions may name on this machine, best last. Without a name
/// it is avx2, or the best below it.
std::vector<std::string_view> instruction_sets();

}  // namespace ensonify::engine
