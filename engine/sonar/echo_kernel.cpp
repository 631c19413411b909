// Compiled once for each of Highway's targets; see the header.

#define HWY_BROKEN_EMU128 1  // so that plain code is the last resort with any compiler
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/sonar/echo_kernel.cpp"
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_SSE4 | HWY_EMU128 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#include <hwy/foreach_target.h>

#include <cmath>

#include <hwy/highway.h>

#include <ensonify/engine/sonar/beam_tables.h>
#include <ensonify/engine/sonar/echo_kernel.h>
#include <ensonify/scatter/backscatter_cells.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, 8>;
using F = hn::Rebind<float, D>;
using I = hn::RebindToSigned<F>;
using L = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VF = hn::Vec<F>;
using VI = hn::Vec<I>;

constexpr D d;
constexpr F f;
constexpr I i32;
constexpr L i64;
constexpr std::size_t lanes = HWY_MAX_BYTES < 8 ? 1 : hn::MaxLanes(d);
static_assert(lanes <= echo_room);

// a b + c, rounded once.
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
HWY_INLINE VF fma(VF a, VF b, VF c) { return fma(f, a, b, c); }
HWY_INLINE V set(double value) { return hn::Set(d, value); }
HWY_INLINE VF set(float value) { return hn::Set(f, value); }

// From the value of two neighbours in a table.
HWY_INLINE VF between(const float* table, VI below, VF share) {
  const VF from = hn::GatherIndex(f, table, below), to = hn::GatherIndex(f, table + 1, below);
  return fma(share, hn::Sub(to, from), from);
}

// Of x in [0, 1], within 2e-8: Abramowitz and Stegun (1964), 4.4.46.
HWY_INLINE V arcsine(V x) {
  V p = set(-0.0012624911);
  for (const double next : {0.0066700901, -0.0170881256, 0.0308918810, -0.0501743046, 0.0889789874,
                            -0.2145988016, 1.5707963050})
    p = fma(p, x, set(next));
  return hn::Sub(set(1.5707963267948966), hn::Mul(hn::Sqrt(hn::Sub(set(1.0), x)), p));
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
HWY_INLINE ArrayRow array_row(const EchoPlane& plane, VF nearness) {
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
HWY_INLINE VF array_value(const EchoPlane& plane, const ArrayRow& row, VF x) {
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
HWY_INLINE VF beam_weight(const EchoPlane& plane, VF range_m, VF cosine, VF sine) {
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

// scatter::BackscatterTable::over_sine. On one facet, where the sine goes as 1 / range, it times the elevation
// that a metre of range stands for falls as the range to the power of `falls`.
HWY_INLINE VF strength_over_sine(const EchoPlane& plane, VI from, VF sine, VF& falls) {
  using namespace scatter::backscatter_cells;
  const VF sine2 = hn::Mul(sine, sine), cosine2 = hn::Sub(set(1.0f), sine2);
  const VF tangent2 =
      hn::Max(set(float(lowest)), hn::Min(set(float(highest)), hn::Div(sine2, hn::Abs(cosine2))));
  constexpr int shift = 23 - cells_per_octave_bits;
  const VI bits = hn::BitCast(i32, tangent2);
  const VI lowest_cell = hn::BitCast(i32, set(float(lowest)));
  const VI cell = hn::Add(from, hn::ShiftRight<shift>(hn::Sub(bits, lowest_cell)));
  constexpr std::int32_t significand = (1 << 23) - 1;
  const VI one = hn::BitCast(i32, set(1.0f));
  const VI fraction =
      hn::And(hn::ShiftLeft<cells_per_octave_bits>(bits), hn::Set(i32, significand));
  const VF place = hn::Sub(hn::BitCast(f, hn::Or(fraction, one)), set(1.0f));
  const VF begin = hn::GatherIndex(f, plane.strengths, cell);
  const VF end = hn::GatherIndex(f, plane.strengths + 1, cell);
  const VF rise = hn::Sub(end, begin);
  const VF value = fma(place, rise, begin);
  const VF mantissa = hn::BitCast(f, hn::Or(hn::And(bits, hn::Set(i32, significand)), one));
  constexpr auto twice_cells = static_cast<float>(2 << cells_per_octave_bits);
  const VF by_tangent2 =
      hn::Div(hn::Mul(hn::Mul(rise, mantissa), set(twice_cells)), hn::Max(value, set(1e-30f)));
  const VF vertical = set(1e-6f);
  falls = hn::Add(set(1.0f), hn::Div(hn::Add(by_tangent2, set(1.0f)), hn::Max(cosine2, vertical)));
  return value;
}

// What the beam adds to the slants, by its change from a piece's one neighbour to the other, if they see about
// the same.
void slant_beam(const EchoPlane& plane) {
  const VF half = set(0.5f), one = set(1.0f);
  const auto load = [&](const std::uint32_t* from) HWY_ATTR {
    return hn::LoadU(i32, reinterpret_cast<const std::int32_t*>(from));
  };
  for (std::size_t i = 1; i + 1 < plane.pieces; i += lanes) {
    const float* weight = plane.weight + i;
    const float* width = plane.width_rad + i;
    const VF here = hn::LoadU(f, weight);
    const VF change = hn::Sub(hn::LoadU(f, weight + 1), hn::LoadU(f, weight - 1));
    const VF widths =
        fma(half, hn::Add(hn::LoadU(f, width - 1), hn::LoadU(f, width + 1)), hn::LoadU(f, width));
    const auto neighbours = hn::And(hn::Eq(load(plane.end + i - 1), load(plane.begin + i)),
                                    hn::Eq(load(plane.end + i), load(plane.begin + i + 1)));
    const auto slight = hn::Lt(hn::Abs(change), hn::Mul(set(0.2f), here));
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

void shade_pieces_here(const EchoPlane& plane) {
  const V zero = hn::Zero(d), one = set(1.0), half = set(0.5);
  for (std::size_t i = 0; i < plane.pieces; i += lanes) {
    const auto load = [&](const std::uint32_t* from) HWY_ATTR {
      return hn::LoadU(i32, reinterpret_cast<const std::int32_t*>(from) + i);
    };
    const VI begin = load(plane.begin), end = load(plane.end);
    const auto middle = hn::PromoteTo(i64, hn::Sub(hn::Add(begin, end), hn::Set(i32, 1)));
    const V cosine = hn::GatherIndex(d, plane.cosines, middle);
    const V sine = hn::GatherIndex(d, plane.sines, middle);
    const V width = hn::Sub(hn::GatherIndex(d, plane.edge_rad, hn::PromoteTo(i64, end)),
                            hn::GatherIndex(d, plane.edge_rad, hn::PromoteTo(i64, begin)));
    const V rays = hn::PromoteTo(d, hn::Sub(end, begin));
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
    const V slope_m = hn::Neg(hn::Mul(hn::Mul(range_m, turning), inverse));  // a radian
    const V grazing_sine = hn::Min(hn::Max(hn::Neg(facing), zero), one);
    const V grazing = hn::IfThenElse(answers, arcsine(grazing_sine), set(-1.0));

    const V grazing_cosine =
        hn::Sqrt(hn::Sub(set(1.0 + 1e-9), hn::Mul(grazing_sine, grazing_sine)));
    const V grazing_way = hn::Neg(hn::Div(hn::Mul(turning, width), grazing_cosine));

    const VF weight = beam_weight(plane, hn::DemoteTo(f, range_m), hn::DemoteTo(f, cosine),
                                  hn::DemoteTo(f, sine));
    VF falls;
    const VF strength = strength_over_sine(plane, hn::LoadU(i32, plane.strengths_from + i),
                                           hn::DemoteTo(f, grazing_sine), falls);
    const V density =
        hn::Div(hn::PromoteTo(d, hn::Mul(weight, strength)), hn::Mul(range_m, range_m));
    const V energy = hn::IfThenElseZero(answers, hn::Mul(density, width));

    const V to_end_m = hn::Mul(half, hn::Mul(slope_m, width));
    const V to_last_m = hn::Sub(to_end_m, hn::Div(to_end_m, rays));
    const V exponent = hn::Sub(set(-2.0), hn::PromoteTo(d, falls));
    const V share = hn::Div(hn::Mul(exponent, hn::Add(to_end_m, to_end_m)), range_m);
    hn::StoreInterleaved4(range_m, to_last_m, to_end_m, energy, d, plane.ranges + 4 * i);

    const V out_m = hn::Mul(range_m, cosine), up_m = hn::Mul(range_m, sine);
    const V out_way = hn::Mul(width, hn::Sub(hn::Mul(slope_m, cosine), up_m));
    const V up_way = hn::Mul(width, fma(slope_m, sine, out_m));
    const auto axis = [&](std::size_t k, V out, V up) HWY_ATTR {
      return fma(out, set(plane.direction[k]), hn::Mul(up, set(plane.pole_direction[k])));
    };
    hn::StoreInterleaved4(axis(0, out_m, up_m), axis(1, out_m, up_m), axis(2, out_m, up_m), grazing,
                          d, plane.middles + 4 * i);
    hn::StoreInterleaved4(axis(0, out_way, up_way), axis(1, out_way, up_way),
                          axis(2, out_way, up_way), grazing_way, d, plane.changes + 4 * i);
    hn::StoreU(weight, f, plane.weight + i);
    hn::StoreU(hn::DemoteTo(f, hn::Min(hn::Max(share, set(-1.0)), one)), f, plane.slant + i);
    hn::StoreU(hn::DemoteTo(f, width), f, plane.width_rad + i);
  }
  slant_beam(plane);
}

}  // namespace

// What is exported must not be unnamed.
void shade_pieces_on(const EchoPlane& plane) { shade_pieces_here(plane); }

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(shade_pieces_on);

void shade_pieces(const EchoPlane& plane) { HWY_DYNAMIC_DISPATCH(shade_pieces_on)(plane); }

}  // namespace ensonify::engine
#endif
