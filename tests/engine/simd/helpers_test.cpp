// The helpers of engine/simd against plain code, on every vector target. Compiled once per Highway
// target, as the kernels are.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/simd/helpers_test.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <hwy/highway.h>

#include <ensonify/engine/simd/gather-inl.h>
#include <ensonify/engine/simd/lanes-inl.h>
#include <ensonify/engine/simd/vec3-inl.h>

namespace ensonify::engine {

#ifndef ENSONIFY_HELPER_FAULTS
#define ENSONIFY_HELPER_FAULTS
/// For each helper, how many numbers differ from the numbers of plain code; and on which target.
struct HelperFaults {
  std::int64_t target, store_some, bits_of, fma, gather, gather_pair, promoted, vectors;
};
#endif

}  // namespace ensonify::engine

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

using F = hn::ScalableTag<float>;
using U = hn::RebindToUnsigned<D>;
using U32 = hn::RebindToUnsigned<F>;

// Numbers whose products need all their bits.
struct Numbers {
  std::uint32_t state = 1;
  double next() {
    state = state * 1664525u + 1013904223u;
    return 1.0 / (1.0 + static_cast<double>(state)) - 1e-9;
  }
};
constexpr int rounds = 1000;

// Numbers by lane, in memory.
template <class Tag>
struct ByLane {
  static constexpr std::size_t count = hn::MaxLanes(Tag());
  alignas(64) hn::TFromD<Tag> at[count];
  ByLane() = default;
  HWY_INLINE explicit ByLane(hn::Vec<Tag> values) { hn::Store(values, Tag(), at); }
  HWY_INLINE explicit ByLane(Numbers& numbers) {
    for (auto& number : at) number = static_cast<hn::TFromD<Tag>>(numbers.next());
  }
  HWY_INLINE hn::Vec<Tag> all() const { return hn::Load(Tag(), at); }
};

template <class Tag>
HWY_INLINE hn::Mask<Tag> mask_of(Tag tag, std::uint32_t bits) {
  ByLane<Tag> set;
  for (std::size_t i = 0; i < set.count; ++i)
    set.at[i] = static_cast<hn::TFromD<Tag>>(bits >> i & 1);
  return hn::Ne(set.all(), hn::Zero(tag));
}

// Tests all masks.
template <class Tag>
HWY_INLINE std::int64_t faults_of_store_some(Tag tag) {
  using Number = hn::TFromD<Tag>;
  constexpr Number untouched = 99;
  constexpr std::size_t count = hn::MaxLanes(tag);
  ByLane<Tag> values;
  for (std::size_t i = 0; i < count; ++i) values.at[i] = static_cast<Number>(i + 1);
  std::int64_t faults = 0;
  for (std::uint32_t mask = 0; mask < 1u << count; ++mask) {
    Number to[count + 2];
    for (Number& number : to) number = untouched;
    store_some(tag, values.all(), mask_of(tag, mask), to + 1);
    std::size_t stored = 1;
    for (std::size_t i = 0; i < count; ++i)
      if (mask >> i & 1) faults += to[stored++] != values.at[i];
    faults += to[0] != untouched || to[count + 1] != untouched;
  }
  return faults;
}

template <class Tag>
HWY_INLINE std::int64_t faults_of_bits_of(Tag tag) {
  std::int64_t faults = 0;
  for (std::uint32_t mask = 0; mask < 1u << hn::MaxLanes(tag); ++mask)
    faults += bits_of(tag, mask_of(tag, mask)) != mask;
  return faults;
}

template <class Tag>
HWY_INLINE std::int64_t faults_of_fma(Tag) {
  Numbers numbers;
  std::int64_t faults = 0;
  for (int round = 0; round < rounds; ++round) {
    const ByLane<Tag> a(numbers), b(numbers);
    ByLane<Tag> c;  // what is left is the rounding of the product
    for (std::size_t i = 0; i < c.count; ++i) c.at[i] = -(a.at[i] * b.at[i]);
    const ByLane<Tag> found(fma(a.all(), b.all(), c.all()));
    for (std::size_t i = 0; i < c.count; ++i)
      faults += found.at[i] != std::fma(a.at[i], b.at[i], c.at[i]);
  }
  return faults;
}

// Numbers of 64 or of 32 bits at any places, in the order of the lanes and against it.
template <class Tag, class Number>
HWY_INLINE std::int64_t faults_of_gather(Tag tag, const Number* table, std::int64_t count) {
  std::int64_t faults = 0;
  for (std::int64_t step = -3; step <= 3; ++step) {
    ByLane<I> places;
    for (std::int64_t i = 0; i < lanes; ++i) places.at[i] = count / 2 + step * i;
    const ByLane<Tag> found(gather(tag, table, places.all()));
    for (std::int64_t i = 0; i < lanes; ++i)
      // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): the bits, also of a NaN
      faults += std::memcmp(&found.at[i], table + places.at[i], sizeof found.at[i]) != 0;
  }
  return faults;
}

HWY_INLINE std::int64_t faults_of_gather_pair(const double* table, std::int64_t count) {
  std::int64_t faults = 0;
  for (std::int64_t step = -3; step <= 3; ++step) {
    ByLane<I> places;
    for (std::int64_t i = 0; i < lanes; ++i) places.at[i] = count / 2 + step * i;
    const auto [at, next] = gather_pair(d, table, places.all());
    const ByLane<D> found(at), found_next(next);
    for (std::int64_t i = 0; i < lanes; ++i)
      faults += found.at[i] != table[places.at[i]] || found_next.at[i] != table[places.at[i] + 1];
  }
  return faults;
}

HWY_INLINE std::int64_t faults_of_promoted(const float* table) {
  const ByLane<D> found(promoted(table + 1));
  std::int64_t faults = 0;
  for (std::int64_t i = 0; i < lanes; ++i) faults += found.at[i] != double{table[1 + i]};
  return faults;
}

HWY_INLINE std::int64_t faults_of_vectors() {
  struct Three {
    ByLane<D> x, y, z;
    HWY_INLINE explicit Three(Numbers& numbers) : x(numbers), y(numbers), z(numbers) {}
    HWY_INLINE explicit Three(V3 v) : x(v.x), y(v.y), z(v.z) {}
    HWY_INLINE V3 all() const { return {x.all(), y.all(), z.all()}; }
  };
  Numbers numbers;
  std::int64_t faults = 0;
  for (int round = 0; round < rounds; ++round) {
    const Three a(numbers), b(numbers);
    const std::uint32_t mask = numbers.state >> 20;
    const Three minus(a.all() - b.all()), times(a.x.all() * b.all()),
        across(cross(a.all(), b.all())), chosen(choose(mask_of(d, mask), a.all(), b.all()));
    const ByLane<D> along(dot(a.all(), b.all()));
    for (std::int64_t i = 0; i < lanes; ++i) {
      const double ax = a.x.at[i], ay = a.y.at[i], az = a.z.at[i];
      const double bx = b.x.at[i], by = b.y.at[i], bz = b.z.at[i];
      faults += minus.x.at[i] != ax - bx || minus.y.at[i] != ay - by || minus.z.at[i] != az - bz;
      faults += times.x.at[i] != ax * bx || times.y.at[i] != ax * by || times.z.at[i] != ax * bz;
      faults += across.x.at[i] != ay * bz - az * by || across.y.at[i] != az * bx - ax * bz ||
                across.z.at[i] != ax * by - ay * bx;
      const Three& one = mask >> i & 1 ? a : b;
      faults += chosen.x.at[i] != one.x.at[i] || chosen.y.at[i] != one.y.at[i] ||
                chosen.z.at[i] != one.z.at[i];
      faults += along.at[i] != std::fma(ax, bx, std::fma(ay, by, az * bz));
    }
  }
  return faults;
}

}  // namespace

void find_helper_faults(HelperFaults& faults) {
  constexpr std::int64_t count = 100;
  double doubles[count];
  float floats[count];
  std::uint64_t words[count];
  Numbers numbers;
  for (std::int64_t i = 0; i < count; ++i) {
    doubles[i] = numbers.next();
    floats[i] = static_cast<float>(numbers.next());
    words[i] = std::uint64_t{numbers.state} << 32 | static_cast<std::uint64_t>(i);
  }
  faults.target = HWY_TARGET;
  // What the kernels store, and registers of half the size.
  faults.store_some = faults_of_store_some(d) + faults_of_store_some(F()) +
                      faults_of_store_some(U32()) + faults_of_store_some(df) +
                      faults_of_store_some(hn::RebindToUnsigned<HalfF>());
  faults.bits_of = faults_of_bits_of(d) + faults_of_bits_of(di) + faults_of_bits_of(df);
  faults.fma = faults_of_fma(d) + faults_of_fma(F()) + faults_of_fma(df);
  faults.gather = faults_of_gather(d, doubles, count) + faults_of_gather(df, floats, count) +
                  faults_of_gather(U(), words, count) + faults_of_gather(U(), floats, count);
  faults.gather_pair = faults_of_gather_pair(doubles, count);
  faults.promoted = faults_of_promoted(floats);
  faults.vectors = faults_of_vectors();
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "support/targets.h"

namespace ensonify::engine {

HWY_EXPORT(find_helper_faults);

TEST_CASE("the helpers of vector registers give what plain code gives, on every target") {
  tests::on_each_target([] {
    const std::int64_t target = hwy::SupportedTargets();
    HelperFaults faults{};
    HWY_DYNAMIC_DISPATCH(find_helper_faults)(faults);
    CHECK(faults.target == ((target & HWY_TARGETS) != 0 ? target : HWY_STATIC_TARGET));
    CHECK(faults.store_some == 0);
    CHECK(faults.bits_of == 0);
    CHECK(faults.fma == 0);
    CHECK(faults.gather == 0);
    CHECK(faults.gather_pair == 0);
    CHECK(faults.promoted == 0);
    CHECK(faults.vectors == 0);
  });
}

}  // namespace ensonify::engine
#endif
