#pragma once

#include <memory>

#include <ensonify/engine/trace/intersector.h>

namespace ensonify::engine {

/// Scan conversion of the fan, without a tree. Each plane of the fan cuts a face in a segment, a
/// segment covers an interval of the plane's rays, and each ray keeps the nearest segment that
/// covers it: a one-dimensional z-buffer. Every face is read once, so this saves time where the
/// face source gives no more faces than the fan can touch.
///
/// No ray slips through between two faces: both compute the place where their edge crosses a plane
/// from the same two positions by the same operations, so they agree on which rays are on either
/// side of it. The nearest face is decided in float where that is certain, in double where two are
/// close, and by the lowest number where double finds equal distances. t, u and v are double. The
/// bits are the same on all machines.
///
/// Takes only fans with elevations that ascend within 90 degrees of the fan's middle. Throws
/// std::invalid_argument for other fans and for lists of rays. Treats a face thinner than 2^-50 of
/// its length as having no area. Keeps a copy of the faces, 42 bytes each.
std::unique_ptr<Intersector> make_fan_scan(const IntersectorOptions& options);

}  // namespace ensonify::engine
