// Turns a scan's z-buffer into hits or into runs of rays. Compiled once per Highway target, as
// scan_kernel.cpp is.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/trace/fan_scan/scan_harvest.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <cmath>

#include <hwy/highway.h>

#include <ensonify/engine/simd/gather-inl.h>
#include <ensonify/engine/trace/fan_frame-inl.h>
#include <ensonify/engine/trace/fan_scan/scan_kernel.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

using U = hn::ScalableTag<std::uint32_t>;
using Half = hn::Rebind<std::int32_t, D>;
constexpr U du;
constexpr Half half;

HWY_INLINE hn::Vec<Half> load(const std::uint32_t* from) {
  return hn::LoadU(half, reinterpret_cast<const std::int32_t*>(from));
}

// Reads face planes from rows of four numbers each. `first` has the index at which each row begins.
HWY_INLINE FacePlane gather_face_plane(const double* rows, hn::Vec<I> first) {
  const auto [x, y] = gather_pair(d, rows, first);
  const auto [z, distance] = gather_pair(d, rows + 2, first);
  return {{x, y, z}, distance};
}

// How many rays from j on have the same nearest face, at most up to `end`.
HWY_INLINE std::int64_t run_from(const std::uint32_t* nearest, std::int64_t j, std::int64_t end) {
  constexpr auto width = static_cast<std::int64_t>(hn::MaxLanes(du));
  const auto candidate = hn::Set(du, nearest[j]);
  for (std::int64_t k = j; k < end; k += width) {
    const auto other = hn::Ne(hn::LoadU(du, nearest + k), candidate);
    const std::intptr_t first = hn::FindFirstTrue(du, other);
    if (first >= 0) return (k + first < end ? k + first : end) - j;
  }
  return end - j;
}

// Writes the hits of rays [from, until), which have one nearest face, from `hits` on; returns how
// many are doubtful. Writes whole vectors, past the end.
HWY_INLINE std::int64_t finish_run(const ScanArgs& args, std::int64_t plane, std::int64_t from,
                                   std::int64_t until, Hit* hits, std::uint32_t* doubtful) {
  const std::int64_t candidate = args.nearest[plane * args.stride + from];
  const float* nearness = args.nearness + plane * args.stride;
  const std::uint32_t index = args.index[candidate];
  const std::uint32_t number = args.numbers ? args.numbers[index] : index;
  const V names =
      hn::BitCast(d, hn::Set(di, static_cast<std::int64_t>(std::uint64_t{index} << 32 | number)));
  const double* x = args.forms + 4 * candidate;
  const double* y = x + 4 * args.max_candidates;
  const double* z = y + 4 * args.max_candidates;
  const V sin_azimuth = hn::Set(d, args.sin_azimuth[plane]);
  const V cos_azimuth = hn::Set(d, args.cos_azimuth[plane]);
  const auto level = [&](std::int64_t i) HWY_ATTR {
    return fma(hn::Set(d, x[i]), sin_azimuth, hn::Set(d, y[i]) * cos_azimuth);
  };
  const V u_level = level(0), v_level = level(1), level_sum = level(2);
  const V u_pole = hn::Set(d, z[0]), v_pole = hn::Set(d, z[1]), pole_sum = hn::Set(d, z[2]);
  const V distance = hn::Set(d, x[3]), per_distance = hn::Set(d, y[3]);
  const V one = hn::Set(d, 1.0), range = hn::Set(d, args.range_m);
  const V agreement = hn::Set(d, 0x1p-10);  // of double with float
  std::int64_t doubts = 0;
  for (std::int64_t j = from; j < until; j += lanes) {
    const V cosine = hn::LoadU(d, args.cos_elevation + j),
            sine = hn::LoadU(d, args.sin_elevation + j);
    // 1 / sum is t / distance; t is known in float. One Newton step, then one Halley step refine
    // it.
    const auto less = [&](V a, V b) HWY_ATTR { return fma(hn::Neg(a), b, one); };
    const V sum = fma(level_sum, cosine, pole_sum * sine);
    const auto near_t = hn::Set(df, 1.0f) / hn::LoadU(df, nearness + j);
    const V guess = hn::PromoteTo(d, near_t) * per_distance;
    const V off = less(sum, guess);
    const V better = fma(guess, off, guess);
    const V lack = less(sum, better);
    const V inverse = fma(better, fma(lack, lack, lack), better);
    const V t = distance * inverse;
    const V u = fma(u_level, cosine, u_pole * sine) * inverse;
    const V v = fma(v_level, cosine, v_pole * sine) * inverse;
    hn::StoreInterleaved4(names, t, u, v, d, reinterpret_cast<double*>(hits + (j - from)));

    const M agrees = hn::Lt(hn::Abs(off), agreement);
    const M sound = hn::And(agrees, hn::Le(t, range));
    const M within = hn::FirstN(d, static_cast<std::size_t>(until - j));
    if (HWY_LIKELY(hn::AllFalse(d, hn::AndNot(sound, within)))) continue;
    const unsigned agree = bits_of(d, agrees), good = bits_of(d, sound);
    for (std::int64_t i = 0; i < lanes && j + i < until; ++i) {
      if (!(agree >> i & 1))
        doubtful[doubts++] = static_cast<std::uint32_t>(j + i);
      else if (!(good >> i & 1))
        hits[j - from + i] = Hit{};
    }
  }
  return doubts;
}

// Clears the rays' z-buffer while it is in the cache.
HWY_INLINE void forget(const ScanArgs& args, std::int64_t plane, std::int64_t from,
                       std::int64_t until) {
  float* nearness = args.nearness + plane * args.stride;
  std::uint32_t* nearest = args.nearest + plane * args.stride;
  for (std::int64_t j = from; j < until; ++j) nearness[j] = 0.0f;
  for (std::int64_t j = from; j < until; ++j) nearest[j] = ScanArgs::no_candidate;
}

// Appends where runs begin and end, and their candidates in rows.index, after the first `count`;
// returns the new count.
HWY_INLINE std::int64_t bound_runs(const std::uint32_t* nearest, std::int64_t from,
                                   std::int64_t until, const RunRows& rows, std::int64_t count) {
  constexpr auto width = static_cast<std::int64_t>(hn::MaxLanes(du));
  const auto none = hn::Set(du, ScanArgs::no_candidate);
  std::int64_t begins = count, ends = count;
  if (nearest[from] != ScanArgs::no_candidate) {
    rows.begin[begins] = static_cast<std::uint32_t>(from);
    rows.index[begins++] = nearest[from];
  }
  for (std::int64_t j = from; j + 1 < until; j += width) {
    const auto here = hn::LoadU(du, nearest + j), next = hn::LoadU(du, nearest + j + 1);
    const auto differ =
        hn::And(hn::Ne(here, next), hn::FirstN(du, static_cast<std::size_t>(until - 1 - j)));
    if (hn::AllFalse(du, differ)) continue;
    const auto behind = hn::Iota(du, 0) + hn::Set(du, static_cast<std::uint32_t>(j + 1));
    const auto end = hn::And(differ, hn::Ne(here, none));
    const auto begin = hn::And(differ, hn::Ne(next, none));
    store_some(du, behind, end, rows.end + ends);
    store_some(du, next, begin, rows.index + begins);
    store_some(du, behind, begin, rows.begin + begins);
    ends += static_cast<std::int64_t>(hn::CountTrue(du, end));
    begins += static_cast<std::int64_t>(hn::CountTrue(du, begin));
  }
  if (nearest[until - 1] != ScanArgs::no_candidate)
    rows.end[ends] = static_cast<std::uint32_t>(until);
  return begins;
}

// Removes rays at the ends of a run that meet its face beyond the range. (The rays within range are
// neighbours.)
HWY_INLINE void trim(const ScanArgs& args, const RunRows& rows, std::int64_t i) {
  const auto beyond = [&](std::uint32_t j) HWY_ATTR {
    const double facing =
        std::fma(rows.level[i], args.cos_elevation[j], rows.pole[i] * args.sin_elevation[j]);
    return !(rows.distance[i] / facing <= args.range_m);
  };
  while (rows.begin[i] < rows.end[i] && beyond(rows.begin[i])) ++rows.begin[i];
  while (rows.begin[i] < rows.end[i] && beyond(rows.end[i] - 1)) --rows.end[i];
}

HWY_INLINE std::int64_t without_empty(const RunRows& rows, std::int64_t from, std::int64_t until) {
  std::int64_t to = from;
  for (std::int64_t i = from; i < until; ++i) {
    if (rows.begin[i] == rows.end[i]) continue;
    rows.begin[to] = rows.begin[i], rows.end[to] = rows.end[i];
    rows.index[to] = rows.index[i], rows.face[to] = rows.face[i];
    rows.level[to] = rows.level[i], rows.pole[to] = rows.pole[i];
    rows.distance[to++] = rows.distance[i];
  }
  return to;
}

}  // namespace

void write_misses(Hit* hits, std::int64_t count) {
  std::int64_t i = 0;
  if constexpr (lanes >= 4) {
    constexpr std::int64_t together = lanes / 4;
    const Hit pattern[2] = {};
    static_assert(sizeof(pattern) >= sizeof(double) * lanes);
    const V misses = hn::LoadU(d, reinterpret_cast<const double*>(pattern));
    for (; i + together <= count; i += together)
      hn::StoreU(misses, d, reinterpret_cast<double*>(hits + i));
  }
  for (; i < count; ++i) hits[i] = Hit{};
}

std::int64_t finish_rays(const ScanArgs& args, std::int64_t plane, std::int64_t from,
                         std::int64_t until, Hit* hits, std::uint32_t* doubtful) {
  const std::uint32_t* nearest = args.nearest + plane * args.stride;
  std::int64_t doubts = 0;
  for (std::int64_t j = from; j < until;) {
    const std::int64_t end = j + run_from(nearest, j, until);
    if (nearest[j] == ScanArgs::no_candidate)
      HWY_NAMESPACE::write_misses(hits + (j - from), end - j);
    else
      doubts += finish_run(args, plane, j, end, hits + (j - from), doubtful + doubts);
    j = end;
  }
  forget(args, plane, from, until);
  return doubts;
}

std::int64_t list_runs(const ScanArgs& args, std::int64_t plane, std::int64_t from,
                       std::int64_t until, const RunRows& rows, std::int64_t count) {
  if (from >= until) return count;
  const std::int64_t end = bound_runs(args.nearest + plane * args.stride, from, until, rows, count);
  const float* nearness = args.nearness + plane * args.stride;
  const auto surely_within = static_cast<float>((1.0 + 0x1p-9) / args.range_m);
  const V sine = hn::Set(d, args.sin_azimuth[plane]), cosine = hn::Set(d, args.cos_azimuth[plane]);
  std::int64_t full = end;  // at least the runs before it have rays
  for (std::int64_t i = count; i < end; i += lanes) {
    const std::int64_t some = end - i < lanes ? end - i : lanes;
    // Highway gathers with signed 32-bit indices; there are fewer than 2^31 candidates.
    const auto within = hn::FirstN(half, static_cast<std::size_t>(some));
    const auto candidate = hn::IfThenElseZero(within, load(rows.index + i));
    const auto at = hn::ShiftLeft<2>(hn::PromoteTo(di, candidate));
    store_cut(gather_face_plane(args.face_planes, at), sine, cosine, rows.level + i, rows.pole + i,
              rows.distance + i);
    const auto gather = [&](const std::uint32_t* table, hn::Vec<Half> index) HWY_ATTR {
      return hn::GatherIndex(half, reinterpret_cast<const std::int32_t*>(table), index);
    };
    const auto store = [&](hn::Vec<Half> values, std::uint32_t* to) HWY_ATTR {
      hn::StoreU(values, half, reinterpret_cast<std::int32_t*>(to));
    };
    const auto index = gather(args.index, candidate);
    store(args.numbers ? gather(args.numbers, index) : index, rows.face + i);
    const auto last = load(rows.end + i) - hn::Set(half, 1);
    const auto near_at = [&](hn::Vec<Half> ray) HWY_ATTR {
      return hn::GatherIndex(df, nearness, hn::IfThenElseZero(within, ray));
    };
    const auto least = hn::Min(near_at(load(rows.begin + i)), near_at(last));
    store(index, rows.index + i);
    const auto far = hn::And(hn::Lt(least, hn::Set(df, surely_within)), hn::RebindMask(df, within));
    if (HWY_LIKELY(hn::AllFalse(df, far))) continue;
    for (std::int64_t k = i; k < i + some; ++k) {
      trim(args, rows, k);
      if (rows.begin[k] == rows.end[k] && k < full) full = k;
    }
  }
  forget(args, plane, from, until);
  return without_empty(rows, full, end);
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(finish_rays);
HWY_EXPORT(write_misses);
HWY_EXPORT(list_runs);

std::int64_t finish_rays(const ScanArgs& args, std::int64_t plane, std::int64_t from,
                         std::int64_t until, Hit* hits, std::uint32_t* doubtful) {
  return HWY_DYNAMIC_DISPATCH(finish_rays)(args, plane, from, until, hits, doubtful);
}

void write_misses(Hit* hits, std::int64_t count) {
  HWY_DYNAMIC_DISPATCH(write_misses)(hits, count);
}

std::int64_t list_runs(const ScanArgs& args, std::int64_t plane, std::int64_t from,
                       std::int64_t until, const RunRows& rows, std::int64_t count) {
  return HWY_DYNAMIC_DISPATCH(list_runs)(args, plane, from, until, rows, count);
}

}  // namespace ensonify::engine
#endif
