// Three-dimensional vectors: a lane of three registers has the x, y and z of one vector. Kernels
// include this file, once per Highway target. It must not use inline functions of the rest of the
// program.

#if defined(ENSONIFY_VEC3) == defined(HWY_TARGET_TOGGLE)
#ifdef ENSONIFY_VEC3
#undef ENSONIFY_VEC3
#else
#define ENSONIFY_VEC3
#endif

#include <cstdint>

#include <hwy/highway.h>

#include <ensonify/engine/simd/lanes-inl.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

using D = hn::ScalableTag<double>;
using HalfF = hn::Rebind<float, D>;
using I = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

// NOLINTBEGIN(misc-definitions-in-headers): each target has its own
constexpr D d;
constexpr I di;
constexpr HalfF df;
constexpr std::int64_t lanes = hn::MaxLanes(d);
// NOLINTEND(misc-definitions-in-headers)

struct V3 {
  V x, y, z;
};
HWY_INLINE V3 operator-(V3 a, V3 b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE V3 operator*(V s, V3 a) { return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)}; }
HWY_INLINE V dot(V3 a, V3 b) { return fma(a.x, b.x, fma(a.y, b.y, hn::Mul(a.z, b.z))); }
// Has no fused operations, so that cross(b, a) is exactly -cross(a, b).
HWY_INLINE V3 cross(V3 a, V3 b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)),
          hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
HWY_INLINE V3 choose(M mask, V3 yes, V3 no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y),
          hn::IfThenElse(mask, yes.z, no.z)};
}

HWY_INLINE V promoted(const float* from) { return hn::PromoteTo(d, hn::LoadU(df, from)); }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#endif
