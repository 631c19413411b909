// Compiled once for each of Highway's targets; see echo_kernel.h.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/sonar/echo/bin_kernel.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <cmath>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <ensonify/engine/simd/vec3-inl.h>
#include <ensonify/engine/sonar/echo/bin_kernel.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

// A piece on its way into bins.
using Q = hn::CappedTag<double, 4>;
constexpr Q quarter;
constexpr std::size_t quarters = HWY_MAX_BYTES < 8 ? 4 : 4 / hn::MaxLanes(quarter);
struct PiecePayload {
  hn::Vec<Q> middle[quarters], change[quarters];
  float weight;
  std::int32_t label;
  std::uint32_t visit;
};
// Puts part of a piece into a bin: that energy, seen at the place `along` the piece, from -1/2 at
// its first end to 1/2 at its last.
HWY_INLINE void put(EchoBins& to, std::size_t index, double energy, double along,
                    const PiecePayload& piece) {
  EchoBin& bin = to.bins[index];
  constexpr int bits = EchoBin::branch_bits;
  const bool first = bin.visit >> bits != piece.visit >> bits;
  bin.lit += first ? piece.weight : 0.0f;
  // A bin with two branches of one plane is layover, except the bin where one branch changes into
  // the next.
  if (HWY_UNLIKELY(!first && bin.visit != piece.visit && index != to.turning))
    to.layover[index] = 1;
  bin.visit = piece.visit;
  if (HWY_UNLIKELY(bin.label != piece.label)) {
    if (bin.label == EchoBin::no_label)
      bin.label = piece.label;
    else
      to.others[to.other_count++] = {energy, static_cast<std::uint32_t>(index),
                                     static_cast<std::uint16_t>(piece.label)};
  }
  bin.energy += energy;
  double* seen = &bin.seen[0];
  for (std::size_t k = 0; k < quarters; ++k, seen += 4 / quarters) {
    const auto place = fma(quarter, hn::Set(quarter, along), piece.change[k], piece.middle[k]);
    hn::Store(fma(quarter, hn::Set(quarter, energy), place, hn::Load(quarter, seen)), quarter,
              seen);
  }
}

constexpr std::size_t bins_ahead = 6;  // to fetch: the second-level cache takes so long

}  // namespace

std::size_t lay_pieces(const PiecesToLay& pieces, std::size_t first_piece, EchoBins& bins) {
  EchoBins to = bins;  // a local copy: no store into a bin can change it
  const double per_m = 1.0 / to.bin_m, last = static_cast<double>(to.count - 1);
  const auto bin_of = [&](double range_m) {
    const double place = range_m * per_m;
    return static_cast<std::size_t>(place < last ? (place > 0.0 ? place : 0.0) : last);
  };
  std::size_t i = first_piece;
  for (; i < pieces.count; ++i) {
    if (HWY_UNLIKELY(to.other_count + to.count > to.other_room)) break;
    if (!pieces.answers[i]) continue;
    const double from_m = pieces.from_m[i], until_m = pieces.until_m[i];
    const std::size_t first = bin_of(from_m), end = bin_of(until_m);
    const bool farther = until_m >= from_m;
    if (pieces.starts_surface[i] || farther != to.farther) {
      ++to.visit;
      to.farther = farther;
      to.turning = first == to.end ? first : to.count;
    }
    to.end = end;
    const double energy = pieces.energy[i];
    if (!(energy > 0.0)) continue;  // out of the beam at that range
    PiecePayload piece{
        .weight = pieces.beam_weight[i], .label = pieces.label[i], .visit = to.visit};
    for (std::size_t k = 0; k < quarters; ++k) {
      const std::size_t at = 4 * i + k * (4 / quarters);
      piece.middle[k] = hn::LoadU(quarter, pieces.middles + at);
      piece.change[k] = hn::LoadU(quarter, pieces.changes + at);
    }
    double slope = pieces.energy_slope[i];
    // A piece seen nearly edge-on spans more range than there is between its neighbours. Its place
    // and its slope are taken at the ranges that it keeps.
    const double growth_m = 2.0 * pieces.to_end_m[i];
    if (HWY_UNLIKELY(std::abs(growth_m) - std::abs(until_m - from_m) > to.bin_m)) {
      const double share = (until_m - from_m) / growth_m;
      const double shift = (0.5 * (from_m + until_m) - pieces.range_m[i]) / growth_m;
      slope *= share;
      for (std::size_t k = 0; k < quarters; ++k) {
        piece.middle[k] = fma(quarter, hn::Set(quarter, shift), piece.change[k], piece.middle[k]);
        piece.change[k] = piece.change[k] * hn::Set(quarter, share);
      }
    }
    double begins = 0.0;  // where a bin's part begins along the piece, 0 to 1
    const auto put_until = [&](std::size_t bin, double ends) HWY_ATTR {
      const double along = 0.5 * (begins + ends) - 0.5;
      put(to, bin, energy * (ends - begins) * std::fma(slope, along, 1.0), along, piece);
    };
    if (first != end) {
      const double inverse = 1.0 / (until_m - from_m);
      const std::size_t step = farther ? 1 : static_cast<std::size_t>(-1);
      const double edge_step_m = farther ? to.bin_m : -to.bin_m;
      double edge_m = to.bin_m * static_cast<double>(farther ? first + 1 : first);
      for (std::size_t bin = first; bin != end; bin += step) {
        const double there = (edge_m - from_m) * inverse;
        const double ends = there < begins ? begins : there;  // by rounding
        const std::size_t later = bin + bins_ahead * step;
        hwy::Prefetch(to.bins + (later < to.count ? later : end));
        put_until(bin, ends);
        begins = ends;
        edge_m += edge_step_m;
      }
    }
    put_until(end, 1.0);
  }
  bins = to;
  return i;
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(lay_pieces);

std::size_t lay_pieces(const PiecesToLay& pieces, std::size_t first, EchoBins& bins) {
  return HWY_DYNAMIC_DISPATCH(lay_pieces)(pieces, first, bins);
}

}  // namespace ensonify::engine
#endif
