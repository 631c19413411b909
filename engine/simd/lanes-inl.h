// Operations on the lanes of a register, for all kernels. Kernels include this file, once per
// Highway target (vector_targets.h). It must not use inline functions of the rest of the program.

#if defined(ENSONIFY_LANES) == defined(HWY_TARGET_TOGGLE)
#ifdef ENSONIFY_LANES
#undef ENSONIFY_LANES
#else
#define ENSONIFY_LANES
#endif

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <hwy/highway.h>

#if HWY_HAVE_SCALABLE
#error "this target's registers have no fixed size: vector_targets.h has to disable it"
#endif

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// Returns a b + c, rounded once.
template <class Vector>
HWY_INLINE Vector fma(Vector a, Vector b, Vector c) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(hn::DFromV<Vector>(), std::fma(hn::GetLane(a), hn::GetLane(b), hn::GetLane(c)));
#else
  static_assert(HWY_NATIVE_FMA, "this target rounds twice: vector_targets.h has to disable it");
  return hn::MulAdd(a, b, c);
#endif
}

/// Returns the mask as a number with one bit per lane; lane 0 is the lowest bit.
template <class Tag, class Mask>
HWY_INLINE unsigned bits_of(Tag tag, Mask mask) {
  static_assert(hn::MaxLanes(tag) <= 8, "one byte of bits is read");
  std::uint8_t bits[8] = {};  // Highway may write eight bytes
  hn::StoreMaskBits(tag, mask, bits);
  return bits[0];
}

/// For each mask, a list of the numbers of the lanes that the mask selects.
template <class Number, std::size_t of_lanes>
struct LanesOfMask {
  static_assert(of_lanes <= 8, "each lane more doubles the table");
  Number lanes[std::size_t{1} << of_lanes][of_lanes] = {};
  constexpr LanesOfMask() {
    for (std::size_t mask = 0; mask < std::size_t{1} << of_lanes; ++mask)
      for (std::size_t lane = 0, count = 0; lane < of_lanes; ++lane)
        if (mask >> lane & 1) lanes[mask][count++] = static_cast<Number>(lane);
  }
};
template <class Number, std::size_t of_lanes>
constexpr LanesOfMask<Number, of_lanes> lanes_of_mask;

/// Stores the lanes that the mask selects, one directly after another. What follows them in memory
/// is overwritten, up to the length of one vector. Two ways are avoided: the instruction that
/// compresses into memory, which takes hundreds of cycles on some machines, and Highway's tables,
/// which may be copied to the stack at each use.
template <class Tag, class Vector, class Mask>
HWY_INLINE void store_some(Tag tag, Vector values, Mask mask, hn::TFromD<Tag>* to) {
#if HWY_TARGET == HWY_SCALAR
  (void)mask;
  hn::StoreU(values, tag, to);
#else
  if constexpr (hn::MaxLanes(tag) > 8) {  // too many for a table; these targets have an instruction
    hn::StoreU(hn::Compress(values, mask), tag, to);
#if HWY_ARCH_X86 && HWY_MAX_BYTES == 64  // AVX-512: for doubles, Highway has a table
  } else if constexpr (sizeof(values) == 64) {
    hn::StoreU(Vector{_mm512_maskz_compress_pd(mask.raw, values.raw)}, tag, to);
#endif
  } else {
    using Numbers = hn::RebindToUnsigned<Tag>;
    const auto& kept =
        lanes_of_mask<hn::TFromD<Numbers>, hn::MaxLanes(tag)>.lanes[bits_of(tag, mask)];
    const auto numbers = hn::IndicesFromVec(tag, hn::LoadU(Numbers(), kept));
    hn::StoreU(hn::TableLookupLanes(values, numbers), tag, to);
  }
#endif
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#endif
