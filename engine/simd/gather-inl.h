// Reads numbers of a table at indices that are in the lanes of a register. Kernels include this
// file, once per Highway target. It must not use inline functions of the rest of the program.
//
// Each lane is loaded separately. On an EPYC (Zen 5), tracing rays over a grid of heights is 5 %
// faster this way than with gather instructions. The indices are stored in memory first, and are
// read as `volatile`, because compilers otherwise take them out of the register one by one, which
// is slower.

#if defined(ENSONIFY_GATHER) == defined(HWY_TARGET_TOGGLE)
#ifdef ENSONIFY_GATHER
#undef ENSONIFY_GATHER
#else
#define ENSONIFY_GATHER
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// The indices of all lanes, stored in memory.
template <class Index>
struct TablePlaces {
  using Tag = hn::DFromV<Index>;
  alignas(64) hn::TFromD<Tag> at[hn::MaxLanes(Tag())];
  HWY_INLINE explicit TablePlaces(Index index) { hn::Store(index, Tag(), at); }
};

/// Returns a vector whose lane k is table[at[k]].
template <class Tag, class Number, class Place>
HWY_INLINE hn::Vec<Tag> lanes_at(Tag tag, const Number* table, const volatile Place* at) {
#if HWY_TARGET == HWY_SCALAR
  hn::TFromD<Tag> value;
  __builtin_memcpy(&value, table + *at, sizeof(value));
  return hn::Set(tag, value);
#else
  if constexpr (hn::MaxLanes(tag) > 1) {
    const hn::Half<Tag> half;
    return hn::Combine(tag, lanes_at(half, table, at + hn::MaxLanes(half)),
                       lanes_at(half, table, at));
  }
  return hn::LoadU(tag, reinterpret_cast<const hn::TFromD<Tag>*>(table + *at));
#endif
}

#if HWY_TARGET != HWY_SCALAR
/// Returns a vector whose block of 128 bits that begins with lane k is loaded from table + at[k].
template <class Tag, class Place>
HWY_INLINE hn::Vec<Tag> blocks_at(Tag tag, const hn::TFromD<Tag>* table, const volatile Place* at) {
  if constexpr (hn::MaxLanes(tag) * sizeof(*table) > 16) {
    const hn::Half<Tag> half;
    return hn::Combine(tag, blocks_at(half, table, at + hn::MaxLanes(half)),
                       blocks_at(half, table, at));
  }
  return hn::LoadU(tag, table + *at);
}
#endif

/// Returns table[index] for each lane of the index.
template <class Tag, class Number, class Index>
HWY_INLINE hn::Vec<Tag> gather(Tag tag, const Number* table, Index index) {
  const TablePlaces<Index> places(index);
  return lanes_at(tag, table, places.at);
}

template <class Vector>
struct Pair {
  Vector at, next;
};
/// Returns table[index] and table[index + 1] for each lane of the index.
template <class Tag, class Index>
HWY_INLINE Pair<hn::Vec<Tag>> gather_pair(Tag tag, const double* table, Index index) {
#if HWY_TARGET == HWY_SCALAR
  return {gather(tag, table, index), gather(tag, table + 1, index)};
#else
  const TablePlaces<Index> places(index);
  const auto even = blocks_at(tag, table, places.at), odd = blocks_at(tag, table, places.at + 1);
  return {hn::InterleaveLower(tag, even, odd), hn::InterleaveUpper(tag, even, odd)};
#endif
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#endif
