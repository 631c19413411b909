#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Embree's tree over the triangles. Fans go through it in packets of neighbouring elevations of
/// one plane: 16 rays with AVX-512, 8 with AVX, otherwise 4.
///
/// Computes in float. Distances are good to about 1e-6 of the range, however far from the mesh's
/// origin, for rays whose origins are floats (nearest_floats.h), as the origins of a sonar's fans
/// are; other origins are rounded to floats. build() refuses vertices beyond 1e9 m. In robust mode,
/// one in some hundreds of the rays that are aimed exactly at a vertex slips through. In fast (not
/// robust) mode, one in six of the rays that are aimed at vertices or edges slips through, and of
/// two faces at one distance either may win. A ray that lies in a face's plane, as far as float can
/// resolve, may be reported to hit the face, even slightly outside the face, at a meaningless
/// distance (`ensonify check` counts these as coplanar). The last bits depend on the instruction
/// set. They do not depend on the tree, with one exception: a face that the ray passes within
/// rounding may be hit in one tree and missed in another, because a face is tested only if the ray
/// meets its box within rounding, and in packets also where it misses the box.
///
/// A tree for many pings shares the triangles' memory, so they must not change while it exists. A
/// tree for one ping copies them, is built in the calling thread, and is a few percent slower to
/// trace.
///
/// Throws std::invalid_argument for an instruction set that the machine does not have, and
/// std::runtime_error if Embree cannot make a device.
std::unique_ptr<Intersector> make_embree(const IntersectorOptions& options);

/// The same back-end ray by ray, to show what packets gain.
std::unique_ptr<Intersector> make_embree_single(const IntersectorOptions& options);

/// The instruction sets of this machine that IntersectorOptions may name, best last. The default is
/// avx2, or the best of the earlier ones if there is no avx2.
std::vector<std::string_view> instruction_sets();

}  // namespace ensonify::engine
