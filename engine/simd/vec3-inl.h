// Three-vectors in vector registers. Kernels include it; they are compiled once per Highway target.
// It must not use inline functions of the rest of the program.

#if defined(ENSONIFY_VEC3) == defined(HWY_TARGET_TOGGLE)
#ifdef ENSONIFY_VEC3
#undef ENSONIFY_VEC3
#else
#define ENSONIFY_VEC3
#endif

#include <cmath>
#include <cstdint>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<double>;
using HalfF = hn::Rebind<float, D>;
using I = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

// NOLINTBEGIN(misc-definitions-in-headers): each target has its own
constexpr D d;
constexpr I di;
constexpr HalfF df;
constexpr std::int64_t lanes = HWY_MAX_BYTES < 8 ? 1 : hn::MaxLanes(d);
// NOLINTEND(misc-definitions-in-headers)

// a b + c with one rounding.
template <class Tag, class Vector>
HWY_INLINE Vector fma(Tag tag, Vector a, Vector b, Vector c) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(tag, std::fma(hn::GetLane(a), hn::GetLane(b), hn::GetLane(c)));
#else
  (void)tag;
  return hn::MulAdd(a, b, c);
#endif
}
HWY_INLINE V fma(V a, V b, V c) { return fma(d, a, b, c); }

// For each mask, the numbers of its lanes, packed.
template <class Number, std::size_t of_lanes>
struct LanesOfMask {
  Number lanes[std::size_t{1} << of_lanes][of_lanes] = {};
  constexpr LanesOfMask() {
    for (std::size_t mask = 0; mask < std::size_t{1} << of_lanes; ++mask)
      for (std::size_t lane = 0, count = 0; lane < of_lanes; ++lane)
        if (mask >> lane & 1) lanes[mask][count++] = lane;
  }
};
template <class Number, std::size_t of_lanes>
constexpr LanesOfMask<Number, of_lanes> lanes_of_mask;

// Stores the lanes of the mask packed; overwrites what follows, up to one vector. It avoids the
// instruction that compresses into memory, which takes hundreds of cycles on some machines, and
// Highway's tables, which may be copied to the stack for each use.
template <class Tag, class Vector, class Mask>
HWY_INLINE void store_some(Tag tag, Vector values, Mask mask, hn::TFromD<Tag>* to) {
#if HWY_TARGET == HWY_SCALAR
  (void)mask;
  hn::StoreU(values, tag, to);
#elif HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  if constexpr (sizeof(*to) == 8)
    hn::StoreU(Vector{_mm512_maskz_compress_pd(mask.raw, values.raw)}, tag, to);
  else
    hn::StoreU(hn::Compress(values, mask), tag, to);
#else
  using Numbers = hn::RebindToUnsigned<Tag>;
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(tag, mask, bits);
  const auto& kept = lanes_of_mask<hn::TFromD<Numbers>, hn::MaxLanes(tag)>.lanes[bits[0]];
  const auto numbers = hn::IndicesFromVec(tag, hn::LoadU(Numbers(), kept));
  hn::StoreU(hn::TableLookupLanes(values, numbers), tag, to);
#endif
}

struct V3 {
  V x, y, z;
};
HWY_INLINE V3 operator-(V3 a, V3 b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE V3 operator*(V s, V3 a) { return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)}; }
HWY_INLINE V dot(V3 a, V3 b) { return fma(a.x, b.x, fma(a.y, b.y, hn::Mul(a.z, b.z))); }
// Without fused operations, so that swapping the vectors changes only the sign.
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
