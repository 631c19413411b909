// Compiled once for each of Highway's targets; see the header.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/sonar/reception/signal_kernel.cpp"
#define ENSONIFY_NO_FMA
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <ensonify/engine/sonar/reception/signal_kernel.h>
#include <ensonify/scatter/ground_texture.h>

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
using D = hn::CappedTag<double, signal_group>;
using HalfF = hn::Rebind<float, D>;
using HalfI = hn::Rebind<std::int32_t, D>;
using HalfU = hn::Rebind<std::uint32_t, D>;
using VD = hn::Vec<D>;

constexpr F f;
constexpr I fi;
constexpr U fu;
constexpr D d;
constexpr HalfF hf;
constexpr HalfI hi;
constexpr HalfU hu;

HWY_INLINE VF set(float value) { return hn::Set(f, value); }
HWY_INLINE VD set_double(double value) { return hn::Set(d, value); }
HWY_INLINE VD load_double(const float* from) { return hn::PromoteTo(d, hn::LoadU(hf, from)); }
/// Rounds towards zero.
HWY_INLINE void store_integer(VD value, std::uint32_t* to) {
  hn::StoreU(hn::BitCast(hu, hn::DemoteTo(hi, value)), hu, to);
}
/// For values below 2^31.
HWY_INLINE VF to_float(VU value) { return hn::ConvertTo(f, hn::BitCast(fi, value)); }

/// Hashes 32 bits (the finaliser of Appleby's MurmurHash3).
HWY_INLINE VU scrambled(VU h) {
  h = hn::Xor(h, hn::ShiftRight<16>(h));
  h = h * hn::Set(fu, 0x85ebca6bu);
  h = hn::Xor(h, hn::ShiftRight<13>(h));
  h = h * hn::Set(fu, 0xc2b2ae35u);
  return hn::Xor(h, hn::ShiftRight<16>(h));
}

/// sin(2 pi t) for t of -1/2 to 1/2, within 0.0011: two parabolas with a correction.
HWY_INLINE VF sine_of_turns(VF t) {
  const VF y = t + t;
  const VF s = set(4.0f) * y * (set(1.0f) - hn::Abs(y));
  return s * (set(0.775f) + set(0.225f) * hn::Abs(s));
}
HWY_INLINE VF wrapped(VF t) { return t - hn::Round(t); }

/// -ln u, where u is (the upper 24 bits + 1/2) / 2^24.
HWY_INLINE VF exponential(VU random) {
  const VU bits = hn::BitCast(fu, to_float(hn::ShiftRight<8>(random)) + set(0.5f));  // of 2^24 u
  const VF exponent = to_float(hn::ShiftRight<23>(bits)) - set(127.0f + 24.0f);
  const VF p =
      hn::BitCast(f, hn::Or(hn::And(bits, hn::Set(fu, 0x007fffffu)), hn::Set(fu, 0x3f800000u))) -
      set(1.0f);
  // log2(1 + p) within 3e-6, fitted; exact at both ends.
  VF poly = set(-0.02583931f);
  poly = poly * p + set(0.12179088f);
  poly = poly * p + set(-0.27789668f);
  poly = poly * p + set(0.4575443f);
  poly = poly * p + set(-0.71814403f);
  poly = poly * p + set(1.4425448f);
  const VF log2 = exponent + poly * p;
  return hn::Max(log2 * set(-0.69314718f), set(0.0f));
}

/// A column of scatter::GammaTable: the upper bits of a random share, as a floating-point number.
HWY_INLINE hn::Vec<I> column_of(VU random) {
  using scatter::GammaTable;
  constexpr int mantissa = 23 - 4;
  static_assert(GammaTable::columns_per_octave == 1 << 4);
  const VF share = (to_float(hn::ShiftRight<8>(random)) + set(0.5f)) * set(0x1p-24f);
  const auto octave_and_part = hn::BitCast(fi, hn::ShiftRight<mantissa>(hn::BitCast(fu, share)));
  constexpr std::int32_t first = (127 - GammaTable::octaves) * GammaTable::columns_per_octave;
  // The greatest random numbers round to a share of 1, for which there is no column.
  const auto last = hn::Set(fi, GammaTable::columns - 1);
  return hn::Min(hn::Max(octave_and_part - hn::Set(fi, first), hn::Zero(fi)), last);
}

/// The share of the mean cross-section that the patch at (x, y) has. `glints`: whether any of the
/// shares of glints is not 0.
HWY_INLINE VF patch_strength(const CellSums::Texture& of, VU x, VU y, hn::Vec<I> row,
                             hn::Vec<I> glint_row, VF glint_share, bool glints) {
  VU random = hn::ShiftRight<patch_bits>(x) * hn::Set(fu, 0xcc9e2d51u);
  random = hn::Xor(random, hn::ShiftRight<15>(random));
  random = scrambled(
      random + (hn::ShiftRight<patch_bits>(y) * hn::Set(fu, 0x1b873593u) + hn::Set(fu, of.key)));
  const VF patch = hn::GatherIndex(f, of.quantiles, row + column_of(random));
  if (!glints) return patch;
  const VU more = random * hn::Set(fu, 0x9e3779b1u);
  const VF points = hn::GatherIndex(f, of.quantiles, glint_row + column_of(more));
  return patch + glint_share * (points - patch);
}

/// Real and imaginary parts of complex numbers of a table.
struct Complex {
  VF re, im;
};
HWY_INLINE Complex gather_complex(const float* table, hn::Vec<I> index) {
#if HWY_TARGET == HWY_SCALAR
  const auto at = index + index;
  return {hn::GatherIndex(f, table, at), hn::GatherIndex(f, table + 1, at)};
#else  // both at once
  constexpr hn::RepartitionToWide<U> both;
  constexpr hn::RebindToSigned<decltype(both)> wide;
  const auto pairs = [&](hn::Vec<HalfI> half) HWY_ATTR {
    return hn::BitCast(f, hn::GatherIndex(both, reinterpret_cast<const std::uint64_t*>(table),
                                          hn::PromoteTo(wide, half)));
  };
  const VF low = pairs(hn::LowerHalf(index)), high = pairs(hn::UpperHalf(hi, index));
  return {hn::ConcatEven(f, high, low), hn::ConcatOdd(f, high, low)};
#endif
}

/// The convolution at the bin whose value `middle` points to.
HWY_INLINE VF convolved(const FilterTaps& filter, const float* middle) {
  const float* taps = filter.taps;
  VF sum = set(taps[0]) * hn::LoadU(f, middle);
  if (filter.even)
    for (std::size_t k = 1; k <= filter.reach; ++k)
      sum = sum + set(taps[k]) * (hn::LoadU(f, middle + k) + hn::LoadU(f, middle - k));
  else
    for (std::size_t k = 1; k <= filter.reach; ++k)
      sum = sum + set(taps[k]) * hn::LoadU(f, middle - k);
  return sum;
}

/// log2 of positive numbers within 1e-9, by the series of artanh around 1, which needs no fused
/// operations.
HWY_INLINE VD log2_of(hn::Vec<HalfF> value) {
  const auto bits = hn::BitCast(hu, value);
  // The offset makes the mantissa lie between 2/3 and 4/3.
  const auto offset = hn::Set(hu, 0x3f2aaaabu);
  const auto exponent = hn::ShiftRight<23>(hn::BitCast(hi, bits - offset));
  const auto rest = hn::BitCast(hf, bits - hn::BitCast(hu, hn::ShiftLeft<23>(exponent)));
  const VD m = hn::PromoteTo(d, rest), one = set_double(1.0);
  const VD s = (m - one) / (m + one), s2 = s * s;
  VD sum = set_double(1.0 / 11.0);
  for (const double odd : {9.0, 7.0, 5.0, 3.0, 1.0}) sum = sum * s2 + set_double(1.0 / odd);
  return hn::PromoteTo(d, exponent) + sum * s * set_double(2.885390081777927);  // 2 / ln 2
}

}  // namespace

void place_cells(const CellPlaces& to) {
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t group = 0; group < to.bins; group += signal_group) {
    std::uint32_t most = 0, placeless = 0;
    for (std::size_t n = group; n < group + signal_group; n += lanes) {
      const VD x = load_double(to.x_m + n), y = load_double(to.y_m + n),
               z = load_double(to.z_m + n);
      const auto lit = hn::Gt(load_double(to.intensity + n), hn::Zero(d));
      if (hn::AllFalse(d, lit)) continue;
      const auto nowhere = hn::Eq(hn::Abs(x) + (hn::Abs(y) + hn::Abs(z)), hn::Zero(d));
      placeless |= hn::AllFalse(d, hn::And(lit, nowhere)) ? 0u : 1u;

      const VD across = set_double(to.across[0]) * x + set_double(to.across[1]) * y +
                        (set_double(to.across[2]) * z + set_double(to.across_add));
      const VD along = set_double(to.along[0]) * x + set_double(to.along[1]) * y +
                       (set_double(to.along[2]) * z + set_double(to.along_add));
      const VD out = across - set_double(to.origin_across);
      const VD range = hn::Max(load_double(to.range_m + n), set_double(1e-3));
      const VD turns = set_double(-to.turns) * out / range;
      hn::StoreU(hn::DemoteTo(hf, turns), hf, to.phase_turns + n);

      const VD cells_per_m = load_double(to.cells_per_m + n);
      const VD middle = along * cells_per_m;
      const VD reach = load_double(to.reach + n);
      const VD first = hn::Floor(middle - reach);
      const VD skewed = set_double(to.skew) * (first - middle) / cells_per_m;
      const VD raised = hn::CopySign(set_double(to.rise) * z, out * z);
      const VD cell = (across - raised + skewed) * set_double(to.across_cells_per_m);
      const VD whole = hn::Floor(cell);
      store_integer(whole, to.across_cell + n);
      const VD within = (cell - whole - set_double(0.5)) * set_double(0x1p32);
      hn::StoreU(hn::Xor(hn::BitCast(hu, hn::DemoteTo(hi, within)), hn::Set(hu, 0x80000000u)), hu,
                 to.across_within + n);

      store_integer(first, to.first_cell + n);
      hn::StoreU(hn::DemoteTo(hf, (first - middle) * set_double(to.columns_per_cell)), hf,
                 to.first_column + n);
      const VD cells = hn::Floor(middle + reach) - first + set_double(1.0);
      const auto in_lanes = hn::MaxOfLanes(d, hn::IfThenElseZero(lit, cells));
      most =
          hn::GetLane(in_lanes) > most ? static_cast<std::uint32_t>(hn::GetLane(in_lanes)) : most;
    }
    to.cells[group / signal_group] = most;
    to.placeless[group / signal_group] = placeless;
  }
}

template <bool textured>
HWY_INLINE void sum_all_cells(const CellSums& sums) {
  const CellSums::Texture& of = sums.texture;
  const VU one = hn::Set(fu, 1u);
  const VF step = set(sums.columns_per_cell), jitter_step = set(sums.columns_per_cell / 256.0f);
  const auto last = hn::Set(fi, static_cast<std::int32_t>(sums.last_column));
  float* strengths = of.strengths;
  for (std::size_t n = 0; n < sums.bins; n += hn::Lanes(f)) {
    if (sums.cells[n / signal_group] == 0) {
      hn::StoreU(hn::Zero(f), f, sums.re + n);
      hn::StoreU(hn::Zero(f), f, sums.im + n);
      continue;
    }
    const VU across = hn::LoadU(fu, sums.across_cell + n);
    VU within = hn::LoadU(fu, sums.across_within + n);
    // From one cell along to the next, the line moves by whole cells across and a part of a cell.
    // If the slope is just below 0, rounding may make the part a whole cell.
    const VF slope = set(sums.across_per_m) / hn::LoadU(f, sums.cells_per_m + n);
    const VF below = hn::Floor(slope);
    const auto rounds_up = hn::Ge(slope - below, set(1.0f));
    const VF whole_slope = below + hn::IfThenElseZero(rounds_up, set(1.0f));
    const VF part = hn::IfThenZeroElse(rounds_up, slope - below);
    const VU across_step = hn::BitCast(fu, hn::ConvertTo(fi, whole_slope));
    const VU within_step =
        hn::ShiftLeft<8>(hn::BitCast(fu, hn::ConvertTo(fi, part * set(0x1p24f))));
    const VU key = hn::LoadU(fu, sums.key + n) + hn::Set(fu, sums.common_key);
    // Products with the cell's numbers are computed by sums from cell to cell, which are cheaper.
    const VU cell = hn::LoadU(fu, sums.first_cell + n);
    const VU golden = hn::Set(fu, 0x9e3779b9u), mix_across = hn::Set(fu, 0xcc9e2d51u),
             mix_along = hn::Set(fu, 0x1b873593u);
    // Neighbouring rows of cells are offset by the golden section of a cell.
    VU stagger = cell * golden;
    VU mixed_along = cell * mix_along + key;
    VU mixed_across = across * mix_across;
    const VU mixed_step = across_step * mix_across;
    const auto row = hn::BitCast(fi, hn::LoadU(fu, sums.first_weight + n));
    const VF turns = hn::LoadU(f, sums.phase_turns + n) * set(0x1p-24f);
    VF begin = hn::LoadU(f, sums.first_column + n);
    VU patch_x = one, patch_y = one, step_x = one, step_y = one;
    auto patch_row = row, glint_row = row;
    VF glint_share = turns;
    bool glints = false, uneven = false;
    if constexpr (textured) {
      patch_x = hn::LoadU(fu, of.x + n);
      patch_y = hn::LoadU(fu, of.y + n);
      step_x = hn::LoadU(fu, of.step_x + n);
      step_y = hn::LoadU(fu, of.step_y + n);
      patch_row = hn::BitCast(fi, hn::LoadU(fu, of.row + n));
      glint_row = hn::BitCast(fi, hn::LoadU(fu, of.glint_row + n));
      glint_share = hn::LoadU(f, of.glint_share + n);
      glints = !hn::AllTrue(f, hn::Eq(glint_share, hn::Zero(f)));
      const auto even = hn::Set(fi, std::int32_t{scatter::GammaTable::even});
      uneven = glints || !hn::AllTrue(fi, hn::Eq(patch_row, even));
    }
    VF sum_re = hn::Zero(f), sum_im = hn::Zero(f), squares = hn::Zero(f);
    for (std::uint32_t i = sums.cells[n / signal_group]; i > 0; --i) {
      const VU place = within + stagger;
      VU random = mixed_across + hn::IfThenElseZero(hn::Lt(place, stagger), mix_across);
      random = hn::Xor(random, hn::ShiftRight<15>(random));
      random = scrambled(random + mixed_along);
      // Takes new random bits from the product, whose upper bits are as evenly distributed.
      const VU more = random * hn::Set(fu, 0x9e3779b1u);

      const VF jitter = to_float(hn::ShiftRight<24>(random)) * jitter_step;
      const VF column = hn::Abs(begin + jitter);
      const auto [weight_re, weight_im] =
          gather_complex(sums.weights, row + hn::Min(hn::ConvertTo(fi, column), last));

      const VF own = to_float(hn::And(random, hn::Set(fu, 0xffffu))) * set(0x1p-16f);
      const VF way = to_float(hn::ShiftRight<8>(place)) * turns;
      const VF t = wrapped(own + way);
      VF power = exponential(more);
      if (textured && uneven) {
        if (!of.known) {
          hn::StoreU(
              patch_strength(of, patch_x, patch_y, patch_row, glint_row, glint_share, glints), f,
              strengths);
          patch_x = patch_x + step_x;
          patch_y = patch_y + step_y;
        }
        power = power * hn::LoadU(f, strengths);
        strengths += hn::Lanes(f);
      }
      const VF magnitude = hn::Sqrt(power);
      const VF s = magnitude * sine_of_turns(t);
      const VF c = magnitude * sine_of_turns(wrapped(t + set(0.25f)));
      sum_re = sum_re + (weight_re * c - weight_im * s);
      sum_im = sum_im + (weight_re * s + weight_im * c);
      squares = squares + (weight_re * weight_re + weight_im * weight_im);
      begin = begin + step;
      within = within + within_step;
      stagger = stagger + golden;
      mixed_along = mixed_along + mix_along;
      mixed_across =
          mixed_across + mixed_step + hn::IfThenElseZero(hn::Lt(within, within_step), mix_across);
    }
    const VF scale = hn::Sqrt(hn::LoadU(f, sums.power + n) / hn::Max(squares, set(1e-6f)));
    hn::StoreU(sum_re * scale, f, sums.re + n);
    hn::StoreU(sum_im * scale, f, sums.im + n);
  }
}

void sum_cells(const CellSums& sums) {
  if (sums.texture.x)
    sum_all_cells<true>(sums);
  else
    sum_all_cells<false>(sums);
}

void draw_complex_normal(std::uint32_t key, std::size_t count, float* re, float* im) {
  const VU its_key = hn::Set(fu, key);
  VU place = hn::BitCast(fu, hn::Iota(fi, 0));
  const VU step = hn::Set(fu, static_cast<std::uint32_t>(hn::Lanes(f)));
  for (std::size_t n = 0; n < count; n += hn::Lanes(f)) {
    const VU random = scrambled(place * hn::Set(fu, 0xcc9e2d51u) + its_key);
    const VU more = scrambled(hn::Xor(random, hn::Set(fu, 0x9e3779b9u)));
    const VF t = wrapped(to_float(hn::ShiftRight<8>(random)) * set(0x1p-24f));
    const VF magnitude = hn::Sqrt(exponential(more));
    hn::StoreU(magnitude * sine_of_turns(wrapped(t + set(0.25f))), f, re + n);
    hn::StoreU(magnitude * sine_of_turns(t), f, im + n);
    place = place + step;
  }
}

void shape(const Shaping& of) {
  const std::size_t reach = of.filter.reach;
  const FilterTaps energy{.taps = of.energy_taps, .reach = reach, .even = of.filter.even};
  for (std::size_t n = 0; n < of.bins; n += hn::Lanes(f)) {
    const VF spread = convolved(energy, of.power + reach + n);
    const VF power = hn::LoadU(f, of.wanted + n);
    // The lower bound avoids a division by zero where there is no energy, or almost none within the
    // filter's reach.
    const VF least = hn::Max(set(1e-6f) * power, set(1e-30f));
    const VF scale = hn::Sqrt(power / hn::Max(spread, least));
    hn::StoreU(scale * convolved(of.filter, of.spread_re + reach + n), f, of.re + n);
    hn::StoreU(scale * convolved(of.filter, of.spread_im + reach + n), f, of.im + n);
  }
}

void detect(const Detection& of) {
  const VF share = set(of.share), leak = set(of.leak), step = set(of.step);
  for (std::size_t n = 0; n < of.bins; n += hn::Lanes(f)) {
    VF re = hn::LoadU(f, of.re + n), im = hn::LoadU(f, of.im + n);
    const VF power = hn::LoadU(f, of.power + n);
    if (of.white_re) {
      const VF amplitude = hn::Sqrt(power);
      re = re + amplitude * convolved(of.filter, of.white_re + of.filter.reach + n);
      im = im + amplitude * convolved(of.filter, of.white_im + of.filter.reach + n);
    }
    VF leaked = hn::Zero(f);  // leaked energy without a phase, if there is no speckle
    if (of.other_re) {
      const VF other_re = leak * hn::LoadU(f, of.other_re + n);
      const VF other_im = leak * hn::LoadU(f, of.other_im + n);
      if (of.white_re) {
        re = re + other_re;
        im = im + other_im;
      } else {
        leaked = other_re * other_re + other_im * other_im;
      }
    }
    VF energy = re * re + im * im;
    if (!of.white_re) energy = energy + (power + leaked);

    const VF gain = step * hn::LoadU(f, of.gain + n);
    VF seen = gain * gain * energy;
    if (of.behind_re) {
      const VF rms = set(of.behind_rms);
      const VF a = gain * re + rms * hn::LoadU(f, of.behind_re + n);
      const VF b = gain * im + rms * hn::LoadU(f, of.behind_im + n);
      seen = a * a + b * b;
    } else {
      seen = seen + set(of.behind_rms * of.behind_rms);
    }
    VF detected = hn::Sqrt(seen);
    energy = share * energy;
    if (!of.peak) detected = share * detected;
    if (!of.first) {
      energy = energy + hn::LoadU(f, of.energy + n);
      const VF before = hn::LoadU(f, of.detected + n);
      detected = of.peak ? hn::Max(detected, before) : detected + before;
    }
    hn::StoreU(energy, f, of.energy + n);
    hn::StoreU(detected, f, of.detected + n);
  }
}

void digitise(const Digitisation& of) {
  constexpr double db_of_octave = 6.020599913279624;
  const std::size_t lanes = hn::Lanes(d);
  const auto samples = [&](const float* amplitudes) HWY_ATTR {
    auto level = hn::Min(hn::Set(hf, of.gain) * hn::LoadU(hf, amplitudes), hn::Set(hf, 1.0f));
    if (of.square_root) level = hn::Sqrt(level);
    VD out = hn::PromoteTo(d, level);
    if (of.curve_range_db > 0.0)
      out = hn::Max(log2_of(hn::Max(level, hn::Set(hf, 1e-37f))) *
                            set_double(db_of_octave / of.curve_range_db) +
                        set_double(1.0),
                    hn::Zero(d));
    out = out * set_double(of.full_scale) + set_double(0.5);
    return hn::BitCast(hu, hn::DemoteTo(hi, out));
  };
  std::size_t n = 0;
  for (; n + lanes <= of.bins; n += lanes)
    hn::StoreU(samples(of.amplitude + n), hu, of.samples + n);
  HWY_ALIGN float last[signal_group] = {};
  HWY_ALIGN std::uint32_t last_samples[signal_group];
  for (std::size_t i = n; i < of.bins; ++i) last[i - n] = of.amplitude[i];
  hn::StoreU(samples(last), hu, last_samples);
  for (std::size_t i = n; i < of.bins; ++i) of.samples[i] = last_samples[i - n];
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(place_cells);
HWY_EXPORT(sum_cells);
HWY_EXPORT(draw_complex_normal);
HWY_EXPORT(shape);
HWY_EXPORT(detect);
HWY_EXPORT(digitise);

void place_cells(const CellPlaces& places) { HWY_DYNAMIC_DISPATCH(place_cells)(places); }
void sum_cells(const CellSums& sums) { HWY_DYNAMIC_DISPATCH(sum_cells)(sums); }
void draw_complex_normal(std::uint32_t key, std::size_t count, float* re, float* im) {
  HWY_DYNAMIC_DISPATCH(draw_complex_normal)(key, count, re, im);
}
void shape(const Shaping& shaping) { HWY_DYNAMIC_DISPATCH(shape)(shaping); }
void detect(const Detection& detection) { HWY_DYNAMIC_DISPATCH(detect)(detection); }
void digitise(const Digitisation& digitisation) { HWY_DYNAMIC_DISPATCH(digitise)(digitisation); }

}  // namespace ensonify::engine
#endif
