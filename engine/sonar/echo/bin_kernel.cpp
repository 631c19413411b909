// Compiled once for each of Highway's targets; see echo_kernel.h.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/sonar/echo/bin_kernel.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <cmath>
#include <numbers>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <ensonify/engine/simd/vec3-inl.h>
#include <ensonify/engine/sonar/echo/bin_kernel.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

using J = hn::Rebind<std::int32_t, D>;
constexpr J j32;

// Where some pieces lie in the bins. One vector register of pieces is computed at a time.
struct Spans {
  static constexpr std::size_t room = 64;
  alignas(64) double share_per_m[room];  // of the piece, signed: negative where the range falls
  alignas(64) std::int32_t first[room], end[room];
  alignas(64) std::int32_t farther[room];  // 1: the range grows from first to end; 0: it falls
  alignas(64) std::int32_t edge_on[room];  // 1: spans more range than there is between neighbours
};
HWY_INLINE void find_spans(const PiecesToLay& pieces, std::size_t begin, std::size_t count,
                           const EchoBins& to, Spans& spans) {
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0), two = hn::Set(d, 2.0);
  const V per_m = hn::Set(d, 1.0 / to.bin_m), bin_m = hn::Set(d, to.bin_m);
  const V last = hn::Set(d, static_cast<double>(to.count - 1));
  const auto bins_of = [&](V range_m) HWY_ATTR {
    return hn::DemoteTo(j32, hn::Min(hn::Max(range_m * per_m, zero), last));
  };
  const auto flags = [&](M which)
                         HWY_ATTR { return hn::DemoteTo(j32, hn::IfThenElseZero(which, one)); };
  static_assert(Spans::room % hn::MaxLanes(d) == 0);
  for (std::size_t k = 0; k < count; k += hn::MaxLanes(d)) {
    const V from_m = hn::LoadU(d, pieces.from_m + begin + k);
    const V until_m = hn::LoadU(d, pieces.until_m + begin + k);
    const V growth_m = two * hn::LoadU(d, pieces.to_end_m + begin + k);
    const V kept_m = until_m - from_m;
    hn::Store(one / kept_m, d, spans.share_per_m + k);
    hn::Store(bins_of(from_m), j32, spans.first + k);
    hn::Store(bins_of(until_m), j32, spans.end + k);
    hn::Store(flags(until_m >= from_m), j32, spans.farther + k);
    hn::Store(flags(hn::Abs(growth_m) - hn::Abs(kept_m) > bin_m), j32, spans.edge_on + k);
  }
}

// What put() needs of a piece.
using Q = hn::CappedTag<double, 4>;
constexpr Q quarter;
constexpr std::size_t quarters = 4 / hn::MaxLanes(quarter);
struct PiecePayload {
  hn::Vec<Q> middle[quarters], change[quarters];
  float weight;
  std::int32_t label;
  std::uint32_t visit;
  bool past;
};
// Puts part of a piece into a bin: the energy `energy` at the place `along` the piece, from -1/2 at
// its first end to 1/2 at its last.
HWY_INLINE void put(EchoBins& to, EchoBin& bin, double energy, double along,
                    const PiecePayload& piece) {
  constexpr int bits = EchoBin::branch_bits;
  const auto index = [&] { return static_cast<std::size_t>(&bin - to.bins); };
  const std::uint32_t change = bin.visit ^ piece.visit;
  const bool first = change >> bits != 0;
  bin.lit += first ? piece.weight : 0.0f;
  // A bin with two branches of one plane is layover, except the bin where one branch changes into
  // the next.
  if (HWY_UNLIKELY(!first && change != 0 && index() != to.turning)) to.layover[index()] = 1;
  bin.visit = piece.visit;
  if (HWY_UNLIKELY(bin.label != piece.label)) {
    if (bin.label == EchoBin::no_label)
      bin.label = piece.label;
    else
      to.others[to.other_count++] = {energy, static_cast<std::uint32_t>(index()),
                                     static_cast<std::uint16_t>(piece.label)};
  }
  bin.energy += energy;
  double* seen = &bin.seen[0];
  if (HWY_UNLIKELY(piece.past)) {
    PastNadir& past = to.past[index()];
    past.energy += energy;
    seen = &past.seen[0];
    if (index() >= to.past_end) to.past_end = index() + 1;
  }
  for (std::size_t k = 0; k < quarters; ++k, seen += 4 / quarters) {
    const auto place = fma(hn::Set(quarter, along), piece.change[k], piece.middle[k]);
    hn::Store(fma(hn::Set(quarter, energy), place, hn::Load(quarter, seen)), quarter, seen);
  }
}

// How many bins ahead to fetch, because the second-level cache takes so long.
constexpr std::ptrdiff_t bins_ahead = 6;

// Lays piece number i, which is number k of the spans.
HWY_INLINE void lay_piece(const PiecesToLay& pieces, std::size_t i, const Spans& spans,
                          std::size_t k, EchoBins& to) {
  if (HWY_UNLIKELY(i == pieces.past && i > 0))
    to.visit = ((to.visit >> EchoBin::branch_bits) + 1) << EchoBin::branch_bits;
  if (!pieces.answers[i]) return;
  const auto first = static_cast<std::size_t>(spans.first[k]);
  const auto end = static_cast<std::size_t>(spans.end[k]);
  const bool farther = spans.farther[k] != 0;
  if (pieces.starts_surface[i] || farther != to.farther) {
    ++to.visit;
    to.farther = farther;
    to.turning = first == to.end ? first : to.count;
  }
  to.end = end;
  const double energy = pieces.energy[i];
  if (!(energy > 0.0)) return;  // out of the beam at that range
  PiecePayload piece{.weight = pieces.beam_weight[i],
                     .label = pieces.label[i],
                     .visit = to.visit,
                     .past = i < pieces.past};
  for (std::size_t q = 0; q < quarters; ++q) {
    const std::size_t at = 4 * i + q * (4 / quarters);
    piece.middle[q] = hn::LoadU(quarter, pieces.middles + at);
    piece.change[q] = hn::LoadU(quarter, pieces.changes + at);
  }
  const double from_m = pieces.from_m[i];
  double slope = pieces.energy_slope[i];
  // A piece seen nearly edge-on spans more range than there is between its neighbours. Its place
  // and its slope are taken at the ranges that it keeps.
  if (HWY_UNLIKELY(spans.edge_on[k])) {
    const double until_m = pieces.until_m[i], growth_m = 2.0 * pieces.to_end_m[i];
    const double share = (until_m - from_m) / growth_m;
    const double shift = (0.5 * (from_m + until_m) - pieces.range_m[i]) / growth_m;
    slope *= share;
    for (std::size_t q = 0; q < quarters; ++q) {
      piece.middle[q] = fma(hn::Set(quarter, shift), piece.change[q], piece.middle[q]);
      piece.change[q] = piece.change[q] * hn::Set(quarter, share);
    }
  }
  double begins = 0.0;  // where a bin's part begins along the piece, 0 to 1
  const auto put_until = [&](EchoBin& bin, double ends) HWY_ATTR {
    const double along = 0.5 * (begins + ends) - 0.5;
    put(to, bin, energy * (ends - begins) * std::fma(slope, along, 1.0), along, piece);
  };
  EchoBin* bin = to.bins + first;
  EchoBin* const last = to.bins + end;
  if (bin != last) {
    const double share_per_m = spans.share_per_m[k];
    const std::ptrdiff_t step = farther ? 1 : -1;
    const double edge_step_m = farther ? to.bin_m : -to.bin_m;
    double edge_m = to.bin_m * static_cast<double>(spans.first[k] + spans.farther[k]);
    for (; bin != last; bin += step) {
      const double there = (edge_m - from_m) * share_per_m;
      const double ends = there < begins ? begins : there;  // only by rounding
      hwy::Prefetch(bin + bins_ahead * step);               // may lie outside; that has no effect
      put_until(*bin, ends);
      begins = ends;
      edge_m += edge_step_m;
    }
  }
  put_until(*last, 1.0);
}

}  // namespace

std::size_t lay_pieces(const PiecesToLay& pieces, std::size_t first, EchoBins& bins) {
  EchoBins to = bins;  // a local copy: no store into a bin can change it
  Spans spans;
  std::size_t i = first;
  const auto has_room = [&] { return to.other_count + to.count <= to.other_room; };
  while (i < pieces.count && has_room()) {
    const std::size_t begin = i, rest = pieces.count - begin;
    const std::size_t count = rest < Spans::room ? rest : Spans::room;
    find_spans(pieces, begin, count, to, spans);
    for (; i < begin + count && HWY_LIKELY(has_room()); ++i)
      lay_piece(pieces, i, spans, i - begin, to);
  }
  bins = to;
  return i;
}

void write_places(const EchoBin* bins, std::size_t count, const std::array<double, 3>& origin,
                  const std::array<float*, 4>& to) {
  constexpr std::size_t step = 4 / quarters, block = 16;
  constexpr double any = 1e300, right_angle = 0.5 * std::numbers::pi;
  const double from[4] = {origin[0], origin[1], origin[2], 0.0};
  // The angle is taken as linear along a piece, so it may exceed its limits.
  const double least[4] = {-any, -any, -any, 0.0}, most[4] = {any, any, any, right_angle};
  constexpr hn::Rebind<float, Q> floats;
  alignas(64) float seen[4 * block];
  for (std::size_t i = 0; i < count; i += block) {
    const std::size_t here = count - i < block ? count - i : block;
    for (std::size_t k = 0; k < here; ++k) {
      const EchoBin& bin = bins[i + k];
      const bool lit = bin.energy > 0.0;
      const auto inverse = hn::Set(quarter, lit ? 1.0 / bin.energy : 0.0);
      for (std::size_t at = 0; at < 4; at += step) {
        const auto mean =
            hn::Load(quarter, &bin.seen[0] + at) * inverse + hn::LoadU(quarter, from + at);
        const auto kept =
            hn::Min(hn::Max(mean, hn::LoadU(quarter, least + at)), hn::LoadU(quarter, most + at));
        hn::Store(hn::DemoteTo(floats, lit ? kept : hn::Zero(quarter)), floats, seen + 4 * k + at);
      }
    }
    for (std::size_t layer = 0; layer < 4; ++layer)
      for (std::size_t k = 0; k < here; ++k) to[layer][i + k] = seen[4 * k + layer];
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(lay_pieces);
HWY_EXPORT(write_places);

std::size_t lay_pieces(const PiecesToLay& pieces, std::size_t first, EchoBins& bins) {
  return HWY_DYNAMIC_DISPATCH(lay_pieces)(pieces, first, bins);
}
void write_places(const EchoBin* bins, std::size_t count, const std::array<double, 3>& origin,
                  const std::array<float*, 4>& to) {
  HWY_DYNAMIC_DISPATCH(write_places)(bins, count, origin, to);
}

}  // namespace ensonify::engine
#endif
