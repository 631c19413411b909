// A face in the frame of a fan, in vector registers. Kernels include it; they are compiled once per
// Highway target. It must not use inline functions of the rest of the program.

#if defined(ENSONIFY_FAN_FRAME) == defined(HWY_TARGET_TOGGLE)
#ifdef ENSONIFY_FAN_FRAME
#undef ENSONIFY_FAN_FRAME
#else
#define ENSONIFY_FAN_FRAME
#endif

#include <hwy/highway.h>

#include <ensonify/engine/simd/vec3-inl.h>
#include <ensonify/engine/trace/fan_frame.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

/// The same FanFrame in every lane of the registers.
struct Frame {
  V3 origin;
  V3 array, middle, pole;
};
HWY_INLINE Frame laid(const FanFrame& frame) {
  const auto at = [](const double* p) HWY_ATTR {
    return V3{hn::Set(d, p[0]), hn::Set(d, p[1]), hn::Set(d, p[2])};
  };
  const double* axes = &frame.axes[0];
  return {at(&frame.origin[0]), at(axes), at(axes + 3), at(axes + 6)};
}
HWY_INLINE V3 into(const Frame& frame, V3 p) {
  const V3 from = p - frame.origin;
  return {dot(frame.array, from), dot(frame.middle, from), dot(frame.pole, from)};
}
struct Corners {
  V3 a, b, c;
};
HWY_INLINE M before(V3 a, V3 b) {
  const M at_z = hn::Lt(a.z, b.z);
  const M at_y = hn::Or(hn::Lt(a.y, b.y), hn::And(hn::Eq(a.y, b.y), at_z));
  return hn::Or(hn::Lt(a.x, b.x), hn::And(hn::Eq(a.x, b.x), at_y));
}
/// Rotates the corners of each face until the corner with the lowest (x, y, z) is first. Returns
/// the number (0, 1 or 2) that this corner had.
HWY_INLINE V put_in_order(Corners& face) {
  const auto [first, second, third] = face;
  const M by_second = before(second, first);
  const M by_third = before(third, choose(by_second, second, first));
  face.a = choose(by_third, third, choose(by_second, second, first));
  face.b = choose(by_third, first, choose(by_second, third, second));
  face.c = choose(by_third, second, choose(by_second, first, third));
  const V turn = hn::IfThenElseZero(by_second, hn::Set(d, 1.0));
  return hn::IfThenElse(by_third, hn::Set(d, 2.0), turn);
}

/// A face's plane: its unit normal, and its distance from the origin along it. All callers share
/// this one computation, so that their bits are equal.
struct FacePlane {
  V3 normal;
  V distance;
};
HWY_INLINE FacePlane face_plane(V3 normal, V distance) {
  const V inverse = hn::Div(hn::Set(d, 1.0), hn::Sqrt(dot(normal, normal)));
  return {inverse * normal, hn::Mul(inverse, distance)};
}
/// The plane of a face whose corners may be in any order.
HWY_INLINE FacePlane face_plane(const Frame& frame, double handedness, Corners face) {
  put_in_order(face);
  const V3 a = into(frame, face.a), b = into(frame, face.b), c = into(frame, face.c);
  const V3 normal = hn::Set(d, handedness) * cross(b - a, c - a);
  return face_plane(normal, dot(normal, a));
}
/// The component of the normal along the direction of a fan's plane at elevation 0. (The component
/// along the pole is the normal's z.)
HWY_INLINE V level_of(const FacePlane& face, V sin_azimuth, V cos_azimuth) {
  return fma(face.normal.x, sin_azimuth, hn::Mul(face.normal.y, cos_azimuth));
}
/// Writes `level`, `pole` and `distance` (see FanRuns) of the faces in one register.
HWY_INLINE void store_cut(const FacePlane& face, V sin_azimuth, V cos_azimuth, double* level,
                          double* pole, double* distance) {
  hn::StoreU(level_of(face, sin_azimuth, cos_azimuth), d, level);
  hn::StoreU(face.normal.z, d, pole);
  hn::StoreU(face.distance, d, distance);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#endif
