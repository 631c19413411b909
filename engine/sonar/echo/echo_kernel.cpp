// Compiled once for each of Highway's targets; see the header.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/sonar/echo/echo_kernel.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <cmath>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <ensonify/engine/sonar/echo/beam_tables.h>
#include <ensonify/engine/sonar/echo/echo_kernel.h>
#include <ensonify/scatter/backscatter_cells.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Doubles, as many floats as a register holds, and half of them, as many as there are doubles.
using D = hn::CappedTag<double, 8>;
using F = hn::CappedTag<float, 16>;
using H = hn::Rebind<float, D>;
using I = hn::RebindToSigned<F>;
using J = hn::RebindToSigned<H>;
using L = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VF = hn::Vec<F>;
using VH = hn::Vec<H>;
using VI = hn::Vec<I>;
using VJ = hn::Vec<J>;

constexpr D d;
constexpr F f;
constexpr H h;
constexpr I i32;
constexpr J j32;
constexpr L i64;
constexpr std::size_t lanes = HWY_MAX_BYTES < 8 ? 1 : hn::MaxLanes(d);
constexpr std::size_t wide = HWY_MAX_BYTES < 8 ? 1 : hn::MaxLanes(f);
constexpr std::size_t halves = wide / lanes;
static_assert(wide <= lane_padding);

// a b + c, rounded once.
template <class Vector>
HWY_INLINE Vector fma(Vector a, Vector b, Vector c) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(hn::DFromV<Vector>(), std::fma(hn::GetLane(a), hn::GetLane(b), hn::GetLane(c)));
#else
  return hn::MulAdd(a, b, c);
#endif
}
HWY_INLINE V set(double value) { return hn::Set(d, value); }
HWY_INLINE VF set(float value) { return hn::Set(f, value); }

// The doubles of a register of floats.
struct Halves {
  V of[halves];
};
template <class Function>
HWY_INLINE Halves each_half(Function value) {
#if HWY_TARGET == HWY_SCALAR
  return {{value(0)}};
#else
  return {{value(0), value(1)}};
#endif
}
HWY_INLINE VF narrowed(const Halves& value) {
#if HWY_TARGET == HWY_SCALAR
  return hn::DemoteTo(f, value.of[0]);
#else
  return hn::Combine(f, hn::DemoteTo(h, value.of[1]), hn::DemoteTo(h, value.of[0]));
#endif
}
HWY_INLINE Halves widened(VF value) {
#if HWY_TARGET == HWY_SCALAR
  return {{hn::PromoteTo(d, value)}};
#else
  return {{hn::PromoteTo(d, hn::LowerHalf(h, value)), hn::PromoteTo(d, hn::UpperHalf(h, value))}};
#endif
}

// From the value of two neighbours in a table.
struct Neighbours {
  VF from, to;
};
HWY_INLINE Neighbours neighbours(const float* table, VI below) {
#if HWY_TARGET == HWY_SCALAR
  return {hn::GatherIndex(f, table, below), hn::GatherIndex(f, table + 1, below)};
#else  // both at once
  const auto both = [&](VJ half) HWY_ATTR {
    const auto offset = hn::ShiftLeft<2>(hn::PromoteTo(i64, half));
    return hn::BitCast(f,
                       hn::GatherOffset(i64, reinterpret_cast<const std::int64_t*>(table), offset));
  };
  const VF low = both(hn::LowerHalf(j32, below)), high = both(hn::UpperHalf(j32, below));
  return {hn::ConcatEven(f, high, low), hn::ConcatOdd(f, high, low)};
#endif
}
HWY_INLINE VF between(const float* table, VI below, VF share) {
  const auto [from, to] = neighbours(table, below);
  return fma(share, hn::Sub(to, from), from);
}

// The angle whose sine is x, in [0, 1], given 1 - x: Abramowitz and Stegun (1964), 4.4.46.
HWY_INLINE VF arcsine(VF x, VF rest) {
  VF p = set(-0.0012624911f);
  for (const float next : {0.0066700901f, -0.0170881256f, 0.0308918810f, -0.0501743046f,
                           0.0889789874f, -0.2145988016f, 1.5707963050f})
    p = fma(p, x, set(next));
  return fma(hn::Neg(hn::Sqrt(rest)), p, set(1.5707963267948966f));
}

// VerticalTable::power.
HWY_INLINE VF vertical_power(const float* table, VF abeam, VF down) {
  const VF t = hn::Div(down, hn::Add(hn::Abs(abeam), hn::Abs(down)));
  const VF behind = hn::Sub(hn::CopySign(set(2.0f), down), t);
  const VF diamond = hn::IfThenElse(hn::Ge(abeam, set(0.0f)), t, behind);
  const VF place = hn::Mul(hn::Add(diamond, set(2.0f)), set(vertical_directions / 4.0f));
  const VI below = hn::Min(hn::ConvertTo(i32, place), hn::Set(i32, vertical_directions - 1));
  return between(table, below, hn::Sub(place, hn::ConvertTo(f, below)));
}

// ArrayTable::row and value.
struct ArrayRow {
  VI values;
  VF share, columns_per_x, scale;
};
HWY_INLINE ArrayRow array_row(const PieceKernelArgs& plane, VF nearness) {
  const VF one = set(1.0f), last = set(static_cast<float>(plane.columns - 1));
  const VF columns_per_x = hn::Div(last, hn::Add(nearness, set(plane.reach)));
  if (plane.far) return {hn::Zero(i32), hn::Zero(f), columns_per_x, one};
  const VF all = hn::Div(nearness, hn::Add(nearness, set(float(array_middle_nearness))));
  const VF place =
      hn::Min(hn::Mul(all, set(float(array_rows))), set(static_cast<float>(array_rows) - 1.001f));
  const VI below = hn::ConvertTo(i32, place);
  return {hn::Mul(below, hn::Set(i32, plane.columns)), hn::Sub(place, hn::ConvertTo(f, below)),
          columns_per_x, hn::Div(one, fma(set(2.0f), nearness, one))};
}
HWY_INLINE VF array_value(const PieceKernelArgs& plane, const ArrayRow& row, VF x) {
  const VF place = hn::Mul(hn::Abs(x), row.columns_per_x);
  const auto inside = hn::Lt(place, set(static_cast<float>(plane.columns - 1)));
  const VI column = hn::ConvertTo(i32, hn::IfThenElseZero(inside, place));
  const VF right = hn::Sub(place, hn::ConvertTo(f, column));
  const VI at = hn::Add(row.values, column);
  VF value = between(plane.array_power, at, right);
  if (!plane.far) {
    const VF next = between(plane.array_power + plane.columns, at, right);
    value = fma(row.share, hn::Sub(next, value), value);
  }
  return hn::IfThenElseZero(inside, value);
}

// Beam::two_way.
HWY_INLINE VF beam_weight(const PieceKernelArgs& plane, VF range_m, VF cosine, VF sine) {
  const auto along = [&](const AlongPlane& vector) HWY_ATTR {
    return fma(cosine, set(vector.level), hn::Mul(sine, set(vector.pole)));
  };
  const VF sent = vertical_power(plane.vertical, along(plane.abeam), along(plane.down));
  VF heard = sent, shift = set(0.0f);
  if (!plane.still) {
    const auto way = [&](const AlongPlane& vector)
                         HWY_ATTR { return hn::Sub(along(vector), set(vector.drift)); };
    shift = fma(range_m, way(plane.array_turn), set(-plane.drift_along));
    heard = vertical_power(plane.vertical, fma(range_m, way(plane.abeam_turn), way(plane.abeam)),
                           fma(range_m, way(plane.down_turn), way(plane.down)));
  }
  const ArrayRow row = array_row(plane, hn::Div(set(plane.transmit.nearness_m), range_m));
  const ArrayRow heard_row =
      plane.alike ? row : array_row(plane, hn::Div(set(plane.receive.nearness_m), range_m));
  VF sum = set(0.0f);
  for (std::size_t i = 0; i < plane.sample_count; ++i) {
    const BeamSample& sample = plane.samples[i];
    const VF sine_off = hn::Mul(cosine, set(sample.sin_azimuth));
    const VF transmitted =
        array_value(plane, row, hn::Mul(sine_off, set(plane.transmit.x_per_sine)));
    const VF received =
        plane.still && plane.alike
            ? transmitted
            : array_value(plane, heard_row,
                          hn::Mul(hn::Add(sine_off, shift), set(plane.receive.x_per_sine)));
    sum = fma(hn::Mul(transmitted, received), set(sample.width_rad), sum);
  }
  return hn::Mul(hn::Mul(hn::Mul(cosine, sent), hn::Mul(heard, sum)),
                 hn::Mul(row.scale, heard_row.scale));
}

// scatter::BackscatterTable::sigma_over_sine, given the squared cosine as well. On one facet, where
// the sine goes as 1 / range, it times the elevation that a metre of range stands for falls as the
// range to the power of `falls`.
HWY_INLINE VF strength_over_sine(const PieceKernelArgs& plane, VI from, VF sine, VF cosine2,
                                 VF& falls) {
  using namespace scatter::backscatter_cells;
  const VF tangent2 = hn::Max(set(float(lowest)),
                              hn::Min(set(float(highest)), hn::Div(hn::Mul(sine, sine), cosine2)));
  constexpr int shift = 23 - cells_per_octave_bits;
  const VI bits = hn::BitCast(i32, tangent2);
  const VI lowest_cell = hn::BitCast(i32, set(float(lowest)));
  const VI cell = hn::Add(from, hn::ShiftRight<shift>(hn::Sub(bits, lowest_cell)));
  constexpr std::int32_t significand = (1 << 23) - 1;
  const VI one = hn::BitCast(i32, set(1.0f));
  const VI fraction =
      hn::And(hn::ShiftLeft<cells_per_octave_bits>(bits), hn::Set(i32, significand));
  const VF place = hn::Sub(hn::BitCast(f, hn::Or(fraction, one)), set(1.0f));
  const auto [begin, end] = neighbours(plane.strengths, cell);
  const VF rise = hn::Sub(end, begin);
  const VF value = fma(place, rise, begin);
  const VF mantissa = hn::BitCast(f, hn::Or(hn::And(bits, hn::Set(i32, significand)), one));
  constexpr auto twice_cells = static_cast<float>(2 << cells_per_octave_bits);
  const VF by_tangent2 =
      hn::Div(hn::Mul(hn::Mul(rise, mantissa), set(twice_cells)), hn::Max(value, set(1e-30f)));
  falls = hn::Add(set(1.0f), hn::Div(hn::Add(by_tangent2, set(1.0f)), cosine2));
  return value;
}

template <class Tag>
HWY_INLINE hn::Vec<Tag> load(Tag tag, const std::uint32_t* from) {
  return hn::LoadU(tag, reinterpret_cast<const std::int32_t*>(from));
}

// At the middle of some rays, twice their number: sine and cosine of the elevation; and between
// their ends.
struct Middle {
  V cosine, sine, width;
};
HWY_INLINE Middle middle_of(const double* cosines, const double* sines, const double* edge_rad,
                            VJ begin, VJ end) {
  const auto middle = hn::PromoteTo(i64, hn::Sub(hn::Add(begin, end), hn::Set(j32, 1)));
  return {hn::GatherIndex(d, cosines, middle), hn::GatherIndex(d, sines, middle),
          hn::Sub(hn::GatherIndex(d, edge_rad, hn::PromoteTo(i64, end)),
                  hn::GatherIndex(d, edge_rad, hn::PromoteTo(i64, begin)))};
}

void limit_runs_here(const RunLimits& limits) {
  for (std::size_t i = 0; i < limits.runs; i += lanes) {
    const auto within = hn::FirstN(j32, limits.runs - i);
    const VJ begin = hn::IfThenElse(within, load(j32, limits.begin + i), hn::Zero(j32));
    const VJ end = hn::IfThenElse(within, load(j32, limits.end + i), hn::Set(j32, 1));
    const Middle at = middle_of(limits.cosines, limits.sines, limits.edge_rad, begin, end);
    const V level = hn::LoadU(d, limits.level + i), pole = hn::LoadU(d, limits.pole + i);
    const V facing = fma(level, at.cosine, hn::Mul(pole, at.sine));
    const V turning = hn::Sub(hn::Mul(pole, at.cosine), hn::Mul(level, at.sine));
    const V growth = hn::Abs(hn::Mul(turning, at.width));
    const V most = hn::Mul(set(limits.max_growth), hn::Abs(facing));
    const auto grows = hn::Gt(growth, most);
    const V share = hn::IfThenElse(grows, hn::Div(most, growth), set(1.0));
    const V rays = hn::ConvertTo(d, hn::PromoteTo(i64, hn::Sub(end, begin)));
    const VJ few = hn::DemoteTo(j32, hn::Max(hn::Mul(rays, share), set(1.0)));
    hn::StoreU(few, j32, reinterpret_cast<std::int32_t*>(limits.most + i));
  }
}

// What the beam adds to the slants, by its change from a piece's one neighbour to the other, if
// they see about the same.
void slant_beam(const PieceKernelArgs& plane) {
  const VF half = set(0.5f), one = set(1.0f);
  for (std::size_t i = 1; i + 1 < plane.pieces; i += wide) {
    const float* weight = plane.weight + i;
    const float* width = plane.width_rad + i;
    const VF here = hn::LoadU(f, weight);
    const VF change = hn::Sub(hn::LoadU(f, weight + 1), hn::LoadU(f, weight - 1));
    const VF widths =
        fma(half, hn::Add(hn::LoadU(f, width - 1), hn::LoadU(f, width + 1)), hn::LoadU(f, width));
    const auto neighbours =
        hn::And(hn::Eq(load(i32, plane.end + i - 1), load(i32, plane.begin + i)),
                hn::Eq(load(i32, plane.end + i), load(i32, plane.begin + i + 1)));
    const auto slight = hn::Lt(hn::Abs(change), hn::Mul(set(0.5f), here));
    const auto use = hn::And(hn::RebindMask(f, neighbours), slight);
    const VF share = hn::Div(hn::Mul(change, hn::LoadU(f, width)),
                             hn::IfThenElse(use, hn::Mul(here, widths), one));
    const VF slant = hn::Add(hn::LoadU(f, plane.slant + i), hn::IfThenElseZero(use, share));
    const auto within = hn::FirstN(f, plane.pieces - 1 - i);
    hn::StoreU(hn::IfThenElse(within, hn::Min(hn::Max(slant, hn::Neg(one)), one),
                              hn::LoadU(f, plane.slant + i)),
               f, plane.slant + i);
  }
}

// Two facets that meet between rays are no farther apart in range than one of them runs from ray to
// ray; twice that is allowed, for the small facets that may lie between. Where the rays' places are
// no farther apart than two bins nothing more is asked.
void join_pieces(PieceKernelArgs& plane) {
  std::size_t count = 0;
  plane.breaks[count++] = 0;
  for (std::size_t i = 1; i < plane.pieces; i += lanes) {
    const auto at = [&](const double* row, std::size_t k)
                        HWY_ATTR { return hn::LoadU(d, row + k); };
    const V last_m = hn::Add(at(plane.range_m_of, i - 1), at(plane.to_last_m, i - 1));
    const V first_m = hn::Sub(at(plane.range_m_of, i), at(plane.to_last_m, i));
    const V meets_m = hn::Mul(set(0.5), hn::Add(last_m, first_m));
    hn::StoreU(meets_m, d, plane.from_m + i);
    hn::StoreU(meets_m, d, plane.until_m + i - 1);

    const VH apart_m = hn::Abs(hn::DemoteTo(h, hn::Sub(first_m, last_m)));
    const auto half_run_m = [&](std::size_t k) HWY_ATTR {
      return hn::Abs(hn::DemoteTo(h, hn::Sub(at(plane.to_end_m, k), at(plane.to_last_m, k))));
    };
    const VH step = hn::Max(hn::LoadU(h, plane.step_rad + i - 1), hn::LoadU(h, plane.step_rad + i));
    const VH far_m = fma(hn::DemoteTo(h, last_m), step, apart_m);
    const auto near = hn::And(
        hn::Le(apart_m, hn::Mul(hn::Set(h, 4.0f), hn::Max(half_run_m(i - 1), half_run_m(i)))),
        hn::Le(far_m, hn::Set(h, static_cast<float>(2.0 * plane.bin_m))));
    const auto same =
        hn::RebindMask(h, hn::Eq(load(j32, plane.index + i - 1), load(j32, plane.index + i)));
    const auto neighbours =
        hn::RebindMask(h, hn::Eq(load(j32, plane.end + i - 1), load(j32, plane.begin + i)));
    const auto answer = hn::Ge(
        hn::Min(hn::LoadU(h, plane.weight + i - 1), hn::LoadU(h, plane.weight + i)), hn::Zero(h));
    const auto sure = hn::And(hn::And(neighbours, answer), hn::Or(same, near));
    const auto broken = hn::AndNot(sure, hn::FirstN(h, plane.pieces - i));
    if (hn::AllFalse(h, broken)) continue;
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(h, broken, bits);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      plane.breaks[count] = static_cast<std::uint32_t>(i + lane);
      count += bits[0] >> lane & 1;
    }
  }
  plane.break_count = count;
}

// Where the middles of pieces are, told from the plane's elevations in doubles.
struct Found {
  Middle at[halves];
  Halves range_m, to_end_m, facing_sine, turning;
  hn::Mask<D> answers[halves];
};
HWY_INLINE Found find_pieces(const PieceKernelArgs& plane, std::size_t first) {
  const V zero = hn::Zero(d), one = set(1.0);
  Found found;
  for (std::size_t half = 0; half < halves; ++half) {
    const std::size_t i = first + half * lanes;
    found.at[half] = middle_of(plane.cosines, plane.sines, plane.edge_rad,
                               load(j32, plane.begin + i), load(j32, plane.end + i));
    const auto& [cosine, sine, width] = found.at[half];
    const V level = hn::LoadU(d, plane.level + i), pole = hn::LoadU(d, plane.pole + i);
    // range = distance / facing, facing being minus the grazing angle's sine.
    const V facing = fma(level, cosine, hn::Mul(pole, sine));
    const V turning = hn::Sub(hn::Mul(pole, cosine), hn::Mul(level, sine));
    const auto seen = hn::Lt(facing, set(-1e-9));
    const V inverse = hn::Div(one, hn::IfThenElse(seen, facing, set(-1.0)));
    const V found_m = hn::Mul(hn::LoadU(d, plane.distance + i), inverse);
    const auto answers =
        hn::And(seen, hn::And(hn::Gt(found_m, zero), hn::Le(found_m, set(2.0 * plane.range_m))));
    const V range_m = hn::IfThenElse(answers, found_m, set(plane.range_m));
    // On one facet, over the piece; no more than makes sense of a straight line.
    const V half_m = hn::Mul(set(0.25), range_m);
    const V free_m =
        hn::Mul(hn::Mul(range_m, turning), hn::Mul(inverse, hn::Mul(set(-0.5), width)));
    found.range_m.of[half] = range_m;
    found.to_end_m.of[half] = hn::Max(hn::Min(free_m, half_m), hn::Neg(half_m));
    found.facing_sine.of[half] = hn::Min(hn::Max(hn::Neg(facing), zero), one);
    found.turning.of[half] = turning;
    found.answers[half] = answers;
  }
  return found;
}

// What half of them see: places and grazing angles.
HWY_INLINE void report_places(const PieceKernelArgs& plane, std::size_t i, const Middle& at,
                              V range_m, V to_end_m, V grazing, V grazing_way) {
  const V out_m = hn::Mul(range_m, at.cosine), up_m = hn::Mul(range_m, at.sine);
  const V longer_m = hn::Add(to_end_m, to_end_m);
  const V out_way = fma(longer_m, at.cosine, hn::Neg(hn::Mul(at.width, up_m)));
  const V up_way = fma(longer_m, at.sine, hn::Mul(at.width, out_m));
  const auto axis = [&](std::size_t k, V level_m, V pole_m) HWY_ATTR {
    return fma(level_m, set(plane.direction[k]), hn::Mul(pole_m, set(plane.pole_direction[k])));
  };
  hn::StoreInterleaved4(axis(0, out_m, up_m), axis(1, out_m, up_m), axis(2, out_m, up_m), grazing,
                        d, plane.middles + 4 * i);
  hn::StoreInterleaved4(axis(0, out_way, up_way), axis(1, out_way, up_way),
                        axis(2, out_way, up_way), grazing_way, d, plane.changes + 4 * i);
}

void shade_pieces_here(PieceKernelArgs& plane) {
  const VF none = set(0.0f), one = set(1.0f);
  for (std::size_t first = 0; first < plane.pieces; first += wide) {
    const Found found = find_pieces(plane, first);
    const auto narrow = [&](auto of) HWY_ATTR { return narrowed(each_half(of)); };
    const VF out = narrow([&](std::size_t half) HWY_ATTR { return found.at[half].cosine; });
    const VF up = narrow([&](std::size_t half) HWY_ATTR { return found.at[half].sine; });
    const VF width_rad = narrow([&](std::size_t half) HWY_ATTR { return found.at[half].width; });
    const VF rest = narrow([&](std::size_t half)
                               HWY_ATTR { return hn::Sub(set(1.0), found.facing_sine.of[half]); });
    const VF near_m = narrowed(found.range_m), end_m = narrowed(found.to_end_m);
    const VF sine = narrowed(found.facing_sine);
    const VF cosine2 = hn::Max(hn::Mul(rest, hn::Add(one, sine)), set(1e-9f));
    const VF grazing_way =
        hn::Neg(hn::Div(hn::Mul(narrowed(found.turning), width_rad), hn::Sqrt(cosine2)));

    const VF weight = beam_weight(plane, near_m, out, up);
    VF falls;
    const VF strength = strength_over_sine(plane, hn::LoadU(i32, plane.strengths_from + first),
                                           sine, cosine2, falls);
    const VF per_m = hn::Div(one, near_m);
    const VF energy = hn::Mul(hn::Mul(weight, strength), hn::Mul(hn::Mul(per_m, per_m), width_rad));
    const VF slant = hn::Mul(hn::Sub(set(-2.0f), falls), hn::Mul(hn::Add(end_m, end_m), per_m));
    const VF per_ray = hn::Div(one, hn::ConvertTo(f, hn::Sub(load(i32, plane.end + first),
                                                             load(i32, plane.begin + first))));
    hn::StoreU(hn::Min(hn::Max(slant, set(-1.0f)), one), f, plane.slant + first);
    hn::StoreU(width_rad, f, plane.width_rad + first);
    hn::StoreU(hn::Mul(width_rad, per_ray), f, plane.step_rad + first);

    const Halves half_step_m = widened(hn::Mul(end_m, per_ray)), energies = widened(energy),
                 weights = widened(hn::Max(weight, none)), angles = widened(arcsine(sine, rest)),
                 ways = widened(grazing_way);
    for (std::size_t half = 0; half < halves; ++half) {
      const std::size_t i = first + half * lanes;
      const V range_m = found.range_m.of[half], to_end_m = found.to_end_m.of[half];
      const auto answers = found.answers[half];
      hn::StoreU(range_m, d, plane.range_m_of + i);
      hn::StoreU(to_end_m, d, plane.to_end_m + i);
      hn::StoreU(hn::Sub(to_end_m, half_step_m.of[half]), d, plane.to_last_m + i);
      hn::StoreU(hn::IfThenElseZero(answers, energies.of[half]), d, plane.energy + i);
      hn::StoreU(hn::DemoteTo(h, hn::IfThenElse(answers, weights.of[half], set(-1.0))), h,
                 plane.weight + i);
      report_places(plane, i, found.at[half], range_m, to_end_m, angles.of[half], ways.of[half]);
    }
  }
  slant_beam(plane);
  join_pieces(plane);
}

// A piece as it is laid into bins.
using Q = hn::CappedTag<double, 4>;
constexpr Q quarter;
constexpr std::size_t quarters = HWY_MAX_BYTES < 8 ? 4 : 4 / hn::MaxLanes(quarter);
struct PiecePayload {
  hn::Vec<Q> middle[quarters], change[quarters];
  float weight;
  std::int32_t label;
  std::uint32_t visit;
};
// Some of it goes into a bin: so much energy, from so far along it, -1/2 to 1/2.
HWY_INLINE void put(EchoBins& to, std::size_t index, double energy, double along,
                    const PiecePayload& piece) {
  EchoBin& bin = to.bins[index];
  constexpr int bits = EchoBin::branch_bits;
  const bool first = bin.visit >> bits != piece.visit >> bits;
  bin.lit += first ? piece.weight : 0.0f;
  // Two branches of a plane in one bin are layover, but where it turns.
  if (HWY_UNLIKELY(!first && bin.visit != piece.visit && index != to.turning))
    to.layover[index] = 1;
  bin.visit = piece.visit;
  if (HWY_UNLIKELY(bin.label != piece.label)) {
    if (bin.label == EchoBin::nobody)
      bin.label = piece.label;
    else
      to.others[to.other_count++] = {energy, static_cast<std::uint32_t>(index),
                                     static_cast<std::uint16_t>(piece.label)};
  }
  bin.energy += energy;
  double* seen = &bin.seen[0];
  for (std::size_t k = 0; k < quarters; ++k, seen += 4 / quarters) {
    const auto place = fma(hn::Set(quarter, along), piece.change[k], piece.middle[k]);
    hn::Store(fma(hn::Set(quarter, energy), place, hn::Load(quarter, seen)), quarter, seen);
  }
}

constexpr std::size_t bins_ahead = 6;  // are fetched: so long the second-level cache takes

std::size_t lay_pieces_here(const PieceKernelArgs& plane, const std::uint16_t* labels,
                            const std::uint8_t* broken, EchoBins& bins, std::size_t from) {
  EchoBins to = bins;  // no store into a bin can change what is here
  const double per_m = 1.0 / to.bin_m, last = static_cast<double>(to.count - 1);
  const auto bin_of = [&](double range_m) {
    const double place = range_m * per_m;
    return static_cast<std::size_t>(place < last ? (place > 0.0 ? place : 0.0) : last);
  };
  std::size_t i = from;
  for (; i < plane.pieces; ++i) {
    if (HWY_UNLIKELY(to.other_count + to.count > to.other_room)) break;
    if (plane.weight[i] < 0.0f) continue;
    const double from_m = plane.from_m[i], until_m = plane.until_m[i];
    const std::size_t first = bin_of(from_m), end = bin_of(until_m);
    const bool farther = until_m >= from_m;
    if (broken[i] || farther != to.farther) {
      ++to.visit;
      to.farther = farther;
      to.turning = first;
    }
    const double energy = plane.energy[i];
    if (!(energy > 0.0)) continue;  // out of the beam at that range
    PiecePayload piece{.weight = plane.weight[i], .label = labels[i], .visit = to.visit};
    for (std::size_t k = 0; k < quarters; ++k) {
      const std::size_t at = 4 * i + k * (4 / quarters);
      piece.middle[k] = hn::LoadU(quarter, plane.middles + at);
      piece.change[k] = hn::LoadU(quarter, plane.changes + at);
    }
    const double slant = plane.slant[i];
    double begins = 0.0;  // how far along the piece a bin begins, 0 to 1
    const auto until = [&](std::size_t bin, double ends) HWY_ATTR {
      const double along = 0.5 * (begins + ends) - 0.5;
      put(to, bin, energy * (ends - begins) * std::fma(slant, along, 1.0), along, piece);
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
        until(bin, ends);
        begins = ends;
        edge_m += edge_step_m;
      }
    }
    until(end, 1.0);
  }
  bins = to;
  return i;
}

}  // namespace

// What is exported must not be unnamed.
void limit_runs_on(const RunLimits& limits) { limit_runs_here(limits); }
void shade_pieces_on(PieceKernelArgs& plane) { shade_pieces_here(plane); }
std::size_t lay_pieces_on(const PieceKernelArgs& plane, const std::uint16_t* labels,
                          const std::uint8_t* broken, EchoBins& bins, std::size_t from) {
  return lay_pieces_here(plane, labels, broken, bins, from);
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(limit_runs_on);
HWY_EXPORT(shade_pieces_on);
HWY_EXPORT(lay_pieces_on);

void limit_runs(const RunLimits& limits) { HWY_DYNAMIC_DISPATCH(limit_runs_on)(limits); }
void shade_pieces(PieceKernelArgs& plane) { HWY_DYNAMIC_DISPATCH(shade_pieces_on)(plane); }

std::size_t lay_pieces(const PieceKernelArgs& plane, const std::uint16_t* labels,
                       const std::uint8_t* broken, EchoBins& bins, std::size_t from) {
  return HWY_DYNAMIC_DISPATCH(lay_pieces_on)(plane, labels, broken, bins, from);
}

}  // namespace ensonify::engine
#endif
