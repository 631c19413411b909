// Compiled once for each of Highway's targets, as fan_kernel.cpp is.

#define HWY_BROKEN_EMU128 1
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/trace/face_planes.cpp"
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_SSE4 | HWY_EMU128 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <ensonify/engine/trace/face_planes.h>
#include <ensonify/engine/trace/fan_vectors.inc>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

// As FaceBlocks orders corners.
HWY_INLINE M before(V3 a, V3 b) {
  const M at_z = hn::Lt(a.z, b.z);
  const M at_y = hn::Or(hn::Lt(a.y, b.y), hn::And(hn::Eq(a.y, b.y), at_z));
  return hn::Or(hn::Lt(a.x, b.x), hn::And(hn::Eq(a.x, b.x), at_y));
}

void find_face_planes_here(const FacePlanes& planes, std::int64_t count) {
  const Frame frame = frame_of(&planes.origin[0], &planes.axes[0]);
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
    const V3 first = corner(0), second = corner(1), third = corner(2);
    const M by_second = before(second, first);
    const M by_third = before(third, choose(by_second, second, first));
    const V3 a = into(frame, choose(by_third, third, choose(by_second, second, first)));
    const V3 b = into(frame, choose(by_third, first, choose(by_second, third, second)));
    const V3 c = into(frame, choose(by_third, second, choose(by_second, first, third)));
    const V3 normal = hn::Set(d, planes.handedness) * cross(b - a, c - a);
    const CutPlane cut = cut_plane(normal, dot(normal, a), sine, cosine);
    hn::StoreU(cut.level, d, planes.level + i);
    hn::StoreU(cut.pole, d, planes.pole + i);
    hn::StoreU(cut.distance, d, planes.distance + i);
  }
}

}  // namespace

// What is exported must not be unnamed.
void find_face_planes_on(const FacePlanes& planes, std::int64_t count) {
  find_face_planes_here(planes, count);
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(find_face_planes_on);

void find_face_planes(const FacePlanes& planes, std::int64_t count) {
  HWY_DYNAMIC_DISPATCH(find_face_planes_on)(planes, count);
}

}  // namespace ensonify::engine
#endif
