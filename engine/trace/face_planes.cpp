// Compiled once per Highway target, as scan_kernel.cpp is.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/trace/face_planes.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <ensonify/engine/trace/face_planes.h>
#include <ensonify/engine/trace/fan_frame-inl.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {

void find_face_planes(const FacePlanes& planes, std::int64_t count) {
  const Frame frame = laid(planes.frame);
  const V sine = hn::Set(d, planes.sin_azimuth), cosine = hn::Set(d, planes.cos_azimuth);
  for (std::int64_t i = 0; i < count; i += lanes) {
    alignas(64) float rows[9 * lanes];
    for (std::int64_t k = 0; k < lanes; ++k) {
      const std::uint32_t* face =
          planes.faces + 3 * std::int64_t{planes.index[i + k < count ? i + k : i]};
      for (std::int64_t corner = 0; corner < 3; ++corner) {
        const float* from = planes.positions + 3 * std::int64_t{face[corner]};
        for (std::int64_t axis = 0; axis < 3; ++axis)
          rows[(3 * corner + axis) * lanes + k] = from[axis];
      }
    }
    const auto corner = [&](std::int64_t k) HWY_ATTR {
      const float* at = rows + 3 * k * lanes;
      return V3{promoted(at), promoted(at + lanes), promoted(at + 2 * lanes)};
    };
    const FacePlane plane =
        face_plane(frame, planes.frame.handedness, {corner(0), corner(1), corner(2)});
    store_cut(plane, sine, cosine, planes.level + i, planes.pole + i, planes.distance + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(find_face_planes);

void find_face_planes(const FacePlanes& planes, std::int64_t count) {
  HWY_DYNAMIC_DISPATCH(find_face_planes)(planes, count);
}

}  // namespace ensonify::engine
#endif
