// Compiled once for each of Highway's targets; see the header.

#define HWY_BROKEN_EMU128 1  // so that plain code is the last resort with any compiler
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/sonar/signal_kernel.cpp"
#define HWY_DISABLED_TARGETS (HWY_EMU128 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <ensonify/engine/sonar/signal_kernel.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using F = hn::CappedTag<float, signal_group>;
using I = hn::RebindToSigned<F>;
using U = hn::RebindToUnsigned<F>;
using VF = hn::Vec<F>;
using VU = hn::Vec<U>;

constexpr F f;
constexpr I fi;
constexpr U fu;

HWY_INLINE VF set(float value) { return hn::Set(f, value); }
/// Of less than 2^31.
HWY_INLINE VF to_float(VU value) { return hn::ConvertTo(f, hn::BitCast(fi, value)); }

/// Scrambles 32 bits (Appleby's MurmurHash3, its finaliser).
HWY_INLINE VU scrambled(VU h) {
  h = hn::Xor(h, hn::ShiftRight<16>(h));
  h = hn::Mul(h, hn::Set(fu, 0x85ebca6bu));
  h = hn::Xor(h, hn::ShiftRight<13>(h));
  h = hn::Mul(h, hn::Set(fu, 0xc2b2ae35u));
  return hn::Xor(h, hn::ShiftRight<16>(h));
}

/// sin(2 pi t) for t of -1/2 to 1/2, within 0.0011: two parabolas, bent.
HWY_INLINE VF sine_of_turns(VF t) {
  const VF y = hn::Add(t, t);
  const VF s = hn::Mul(hn::Mul(set(4.0f), y), hn::Sub(set(1.0f), hn::Abs(y)));
  return hn::Mul(s, hn::Add(set(0.775f), hn::Mul(set(0.225f), hn::Abs(s))));
}
HWY_INLINE VF wrapped(VF t) { return hn::Sub(t, hn::Round(t)); }

/// The root of -ln u, u being the upper 24 bits and a half, over 2^24.
HWY_INLINE VF rayleigh(VU random) {
  const VF u = hn::Mul(hn::Add(to_float(hn::ShiftRight<8>(random)), set(0.5f)), set(0x1p-24f));
  const VU bits = hn::BitCast(fu, u);
  const VF exponent = hn::Sub(to_float(hn::ShiftRight<23>(bits)), set(127.0f));
  const VF p = hn::Sub(
      hn::BitCast(f, hn::Or(hn::And(bits, hn::Set(fu, 0x007fffffu)), hn::Set(fu, 0x3f800000u))),
      set(1.0f));
  // log2(1 + p) within 3e-6, fitted; exact at both ends.
  VF poly = set(-0.02583931f);
  poly = hn::Add(hn::Mul(poly, p), set(0.12179088f));
  poly = hn::Add(hn::Mul(poly, p), set(-0.27789668f));
  poly = hn::Add(hn::Mul(poly, p), set(0.4575443f));
  poly = hn::Add(hn::Mul(poly, p), set(-0.71814403f));
  poly = hn::Add(hn::Mul(poly, p), set(1.4425448f));
  const VF log2 = hn::Add(exponent, hn::Mul(poly, p));
  return hn::Sqrt(hn::Max(hn::Mul(log2, set(-0.69314718f)), set(0.0f)));
}

void sum_cells_here(const CellSums& sums) {
  const VU one = hn::Set(fu, 1u);
  const VF step = set(sums.columns_per_cell);
  const auto last = hn::Set(fi, static_cast<std::int32_t>(sums.last_column));
  for (std::size_t n = 0; n < sums.bins; n += hn::Lanes(f)) {
    const VU across = hn::LoadU(fu, sums.across_cell + n);
    const VU within = hn::LoadU(fu, sums.across_within + n);
    const VU key = hn::LoadU(fu, sums.key + n);
    const auto row = hn::BitCast(fi, hn::LoadU(fu, sums.first_weight + n));
    const VF turns = hn::LoadU(f, sums.turns + n);
    VU cell = hn::LoadU(fu, sums.first_cell + n);
    VF begin = hn::LoadU(f, sums.first_column + n);
    VF sum_re = hn::Zero(f), sum_im = hn::Zero(f), squares = hn::Zero(f);
    for (std::uint32_t i = sums.cells[n / signal_group]; i > 0; --i) {
      // Rows of cells are staggered, by the golden section of a cell.
      const VU stagger = hn::Mul(cell, hn::Set(fu, 0x9e3779b9u));
      const VU place = hn::Add(within, stagger);
      const VU its_across = hn::Add(across, hn::IfThenElseZero(hn::Lt(place, stagger), one));
      VU random = hn::Mul(its_across, hn::Set(fu, 0xcc9e2d51u));
      random = hn::Xor(random, hn::ShiftRight<15>(random));
      random = scrambled(hn::Add(random, hn::Add(hn::Mul(cell, hn::Set(fu, 0x1b873593u)), key)));
      const VU more = scrambled(hn::Add(random, hn::Set(fu, 0x9e3779b9u)));

      const VF jitter = hn::Mul(to_float(hn::ShiftRight<24>(random)), set(1.0f / 256.0f));
      const VF column = hn::Abs(hn::Add(begin, hn::Mul(jitter, step)));
      const auto index = hn::Add(row, hn::Min(hn::ConvertTo(fi, column), last));
      const auto pair = hn::Add(index, index);
      const VF weight_re = hn::GatherIndex(f, sums.weights, pair);
      const VF weight_im = hn::GatherIndex(f, sums.weights, hn::Add(pair, hn::Set(fi, 1)));

      const VF own = hn::Mul(to_float(hn::And(random, hn::Set(fu, 0xffffu))), set(0x1p-16f));
      const VF way = hn::Mul(hn::Mul(to_float(hn::ShiftRight<8>(place)), set(0x1p-24f)), turns);
      const VF t = wrapped(hn::Add(own, way));
      const VF magnitude = rayleigh(more);
      const VF s = hn::Mul(magnitude, sine_of_turns(t));
      const VF c = hn::Mul(magnitude, sine_of_turns(wrapped(hn::Add(t, set(0.25f)))));
      sum_re = hn::Add(sum_re, hn::Sub(hn::Mul(weight_re, c), hn::Mul(weight_im, s)));
      sum_im = hn::Add(sum_im, hn::Add(hn::Mul(weight_re, s), hn::Mul(weight_im, c)));
      squares =
          hn::Add(squares, hn::Add(hn::Mul(weight_re, weight_re), hn::Mul(weight_im, weight_im)));
      cell = hn::Add(cell, one);
      begin = hn::Add(begin, step);
    }
    const VF scale = hn::Div(set(1.0f), hn::Sqrt(hn::Max(squares, set(1e-30f))));
    hn::StoreU(hn::Mul(sum_re, scale), f, sums.re + n);
    hn::StoreU(hn::Mul(sum_im, scale), f, sums.im + n);
  }
}

void draw_complex_normal_here(std::uint32_t key, std::size_t count, float* re, float* im) {
  const VU its_key = hn::Set(fu, key);
  VU place = hn::BitCast(fu, hn::Iota(fi, 0));
  const VU step = hn::Set(fu, static_cast<std::uint32_t>(hn::Lanes(f)));
  for (std::size_t n = 0; n < count; n += hn::Lanes(f)) {
    const VU random = scrambled(hn::Add(hn::Mul(place, hn::Set(fu, 0xcc9e2d51u)), its_key));
    const VU more = scrambled(hn::Xor(random, hn::Set(fu, 0x9e3779b9u)));
    const VF t = wrapped(hn::Mul(to_float(hn::ShiftRight<8>(random)), set(0x1p-24f)));
    const VF magnitude = rayleigh(more);
    hn::StoreU(hn::Mul(magnitude, sine_of_turns(wrapped(hn::Add(t, set(0.25f))))), f, re + n);
    hn::StoreU(hn::Mul(magnitude, sine_of_turns(t)), f, im + n);
    place = hn::Add(place, step);
  }
}

void convolve_here(const float* taps, std::size_t reach, const float* in, std::size_t count,
                   float* out) {
  const float* const middle = in + reach;
  std::size_t n = 0;
  for (; n + hn::Lanes(f) <= count; n += hn::Lanes(f)) {
    VF sum = hn::Mul(set(taps[0]), hn::LoadU(f, middle + n));
    for (std::size_t d = 1; d <= reach; ++d)
      sum = hn::Add(sum, hn::Mul(set(taps[d]), hn::Add(hn::LoadU(f, middle + n + d),
                                                       hn::LoadU(f, middle + n - d))));
    hn::StoreU(sum, f, out + n);
  }
  for (; n < count; ++n) {
    float sum = taps[0] * middle[n];
    for (std::size_t d = 1; d <= reach; ++d) sum += taps[d] * (middle[n + d] + *(middle + n - d));
    out[n] = sum;
  }
}

}  // namespace

// What is exported must not be unnamed.
void sum_cells_on(const CellSums& sums) { sum_cells_here(sums); }
void draw_complex_normal_on(std::uint32_t key, std::size_t count, float* re, float* im) {
  draw_complex_normal_here(key, count, re, im);
}
void convolve_on(const float* taps, std::size_t reach, const float* in, std::size_t count,
                 float* out) {
  convolve_here(taps, reach, in, count, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(sum_cells_on);
HWY_EXPORT(draw_complex_normal_on);
HWY_EXPORT(convolve_on);

void sum_cells(const CellSums& sums) { HWY_DYNAMIC_DISPATCH(sum_cells_on)(sums); }
void draw_complex_normal(std::uint32_t key, std::size_t count, float* re, float* im) {
  HWY_DYNAMIC_DISPATCH(draw_complex_normal_on)(key, count, re, im);
}
void convolve(const float* taps, std::size_t reach, const float* in, std::size_t count,
              float* out) {
  HWY_DYNAMIC_DISPATCH(convolve_on)(taps, reach, in, count, out);
}

}  // namespace ensonify::engine
#endif
