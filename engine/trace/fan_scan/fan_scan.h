#pragma once

#include <memory>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Scan conversion of the fan, without a tree. Each plane of the fan cuts a face in a segment, a
/// segment covers an interval of the plane's rays, and each ray keeps the nearest segment that
/// covers it: a z-buffer of one dimension. Every face is looked at once, so it pays where the
/// surface hands out no more faces than the fan can touch.
///
/// No ray slips through between two faces: they find the place where their edge crosses a plane
/// from the same two positions by the same operations, and so agree on which rays are to either
/// side of it. What is nearest is decided in float where that is certain, in double where it is
/// near, and by the lowest number where double finds one distance. t, u and v are double. The bits
/// are the same on all machines.
///
/// Takes fans only, with elevations that ascend within 90 degrees of the fan's middle: for a list
/// of rays, or another fan, it throws std::invalid_argument. A face thinner than 2^-50 of its
/// length has no area for it. Keeps a copy of the faces, 42 bytes for each.
std::unique_ptr<Intersector> make_fan_scan(const IntersectorOptions& options);

}  // namespace ensonify::engine
