// Compiled once for each of Highway's targets; see the header.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/sonar/echo/echo_kernel.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <ensonify/engine/simd/gather-inl.h>
#include <ensonify/engine/simd/lanes-inl.h>
#include <ensonify/engine/sonar/echo/echo_kernel.h>
#include <ensonify/scatter/backscatter_cells.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

// A register of floats has `wide` pieces. Doubles take these in halves of `lanes` pieces.
using D = hn::CappedTag<double, 8>;
using F = hn::CappedTag<float, 16>;
using H = hn::Rebind<float, D>;  // the floats of one half
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
constexpr std::size_t lanes = hn::MaxLanes(d);
constexpr std::size_t wide = hn::MaxLanes(f);
constexpr std::size_t halves = wide / lanes;
static_assert(wide <= lane_padding);

HWY_INLINE V set(double value) { return hn::Set(d, value); }
HWY_INLINE VF set(float value) { return hn::Set(f, value); }
template <class Vector>
HWY_INLINE Vector clamp(Vector value, Vector lowest, Vector highest) {
  return hn::Min(hn::Max(value, lowest), highest);
}

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

// Two neighbouring values of a table.
struct Neighbours {
  VF from, to;
};
HWY_INLINE Neighbours neighbours(const float* table, VI below) {
#if HWY_TARGET == HWY_SCALAR
  return {hn::GatherIndex(f, table, below), hn::GatherIndex(f, table + 1, below)};
#else  // both at once
  const TablePlaces<VI> places(below);
  const VF low = hn::BitCast(f, lanes_at(i64, table, places.at)),
           high = hn::BitCast(f, lanes_at(i64, table, places.at + lanes));
  return {hn::ConcatEven(f, high, low), hn::ConcatOdd(f, high, low)};
#endif
}
HWY_INLINE VF interpolated(const float* table, VI below, VF share) {
  const auto [from, to] = neighbours(table, below);
  return fma(share, to - from, from);
}

// Two neighbouring columns of two rows of ArrayTable. One load per lane takes all four values,
// which are then transposed: faster than four gathers.
struct Corners {
  Neighbours lower, upper;  // by row
};
HWY_INLINE Corners corners(const float* table, VI at) {
#if HWY_TARGET == HWY_SCALAR
  const float* from = table + 2 * hn::GetLane(at);
  return {{set(from[0]), set(from[2])}, {set(from[1]), set(from[3])}};
#else
  const TablePlaces<VI> places(at + at);
  const VF a = blocks_at(f, table, places.at), b = blocks_at(f, table, places.at + 1),
           c = blocks_at(f, table, places.at + 2), e = blocks_at(f, table, places.at + 3);
  const hn::Repartition<double, F> pairs;
  const auto lower_half = [&](VF x, VF y)
                              HWY_ATTR { return hn::BitCast(pairs, hn::InterleaveLower(f, x, y)); };
  const auto upper_half = [&](VF x, VF y)
                              HWY_ATTR { return hn::BitCast(pairs, hn::InterleaveUpper(f, x, y)); };
  const auto first = [&](auto x, auto y)
                         HWY_ATTR { return hn::BitCast(f, hn::InterleaveLower(pairs, x, y)); };
  const auto second = [&](auto x, auto y)
                          HWY_ATTR { return hn::BitCast(f, hn::InterleaveUpper(pairs, x, y)); };
  const auto left_ab = lower_half(a, b), left_ce = lower_half(c, e), right_ab = upper_half(a, b),
             right_ce = upper_half(c, e);
  return {{first(left_ab, left_ce), first(right_ab, right_ce)},
          {second(left_ab, left_ce), second(right_ab, right_ce)}};
#endif
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
  const VF t = down / (hn::Abs(abeam) + hn::Abs(down));
  const VF behind = hn::CopySign(set(2.0f), down) - t;
  const VF diamond = hn::IfThenElse(abeam >= set(0.0f), t, behind);
  const VF place = (diamond + set(2.0f)) * set(vertical_directions / 4.0f);
  const VI below = hn::Min(hn::ConvertTo(i32, place), hn::Set(i32, vertical_directions - 1));
  return interpolated(table, below, place - hn::ConvertTo(f, below));
}

// How far an array that is focused in zones is out of focus.
HWY_INLINE VF defocus(const PlaneBeam& beam, const PlaneBeam::Array& array, VF range_m) {
  VF least = hn::Abs(set(1.0f) - range_m * set(beam.zones_per_m[0]));
  for (std::size_t i = 1; i < array.zone_count; ++i)
    least = hn::Min(least, hn::Abs(set(1.0f) - range_m * set(beam.zones_per_m[i])));
  return least;
}

// ArrayTable::row and value.
struct ArrayRow {
  VI values;
  VF share, columns_per_x, scale;
};
HWY_INLINE ArrayRow array_row(const PlaneBeam& beam, const PlaneBeam::Array& array, VF range_m) {
  const float last = static_cast<float>(array.columns - 1);
  const VF one = set(1.0f);
  if (beam.focused) return {hn::Zero(i32), hn::Zero(f), set(last / array.reach), one};
  VF nearness = set(array.nearness_m) / range_m;
  if (array.zone_count > 0) nearness = nearness * defocus(beam, array, range_m);
  const VF columns_per_x = set(last) / (nearness + set(array.reach));
  const VF all = nearness / (nearness + set(float(array_middle_nearness)));
  const VF place =
      hn::Min(all * set(float(array_rows)), set(static_cast<float>(array_rows) - 1.001f));
  const VI below = hn::ConvertTo(i32, place);
  return {below * hn::Set(i32, array.columns), place - hn::ConvertTo(f, below), columns_per_x,
          one / fma(set(2.0f), nearness, one)};
}
HWY_INLINE VF array_value(const PlaneBeam::Array& array, const ArrayRow& row, VF x) {
  const VF place = hn::Abs(x) * row.columns_per_x;
  const auto inside = place < set(static_cast<float>(array.columns - 1));
  // This is frequent in planes that only the near field reaches.
  if (hn::AllFalse(f, inside)) return hn::Zero(f);
  const VI column = hn::ConvertTo(i32, hn::IfThenElseZero(inside, place));
  const VF right = place - hn::ConvertTo(f, column);
  const VI at = row.values + column;
  const Corners power = corners(array.power, at);
  const auto in_row = [&](const Neighbours& values)
                          HWY_ATTR { return fma(right, values.to - values.from, values.from); };
  const VF lower = in_row(power.lower);
  return hn::IfThenElseZero(inside, fma(row.share, in_row(power.upper) - lower, lower));
}

// Beam::two_way. `aside`: how far the middle of the beam over the plane's samples lies ahead of the
// plane, as a sine of azimuth; only for a transmitter that lies aside, else 0.
HWY_INLINE VF two_way(const PlaneBeam& beam, VF range_m, VF cosine, VF sine, VF& aside) {
  const auto along = [&](const AlongPlane& vector) HWY_ATTR {
    return fma(cosine, set(vector.level), sine * set(vector.pole));
  };
  const VF sent = vertical_power(beam.vertical, along(beam.abeam), along(beam.down));
  VF heard = sent, shift = set(0.0f);
  if (!beam.steady) {
    const auto back = [&](const AlongPlane& vector)
                          HWY_ATTR { return along(vector) - set(vector.drift); };
    shift = fma(range_m, back(beam.array_turn), set(-beam.drift_along));
    heard = vertical_power(beam.vertical, fma(range_m, back(beam.abeam_turn), back(beam.abeam)),
                           fma(range_m, back(beam.down_turn), back(beam.down)));
  }
  const ArrayRow row = array_row(beam, beam.transmit, range_m);
  const ArrayRow heard_row = beam.same_arrays ? row : array_row(beam, beam.receive, range_m);
  VF sent_x = set(0.0f);
  const bool lopsided = beam.transmit.offset_m != 0.0f;  // one of several beams
  if (lopsided) sent_x = set(beam.transmit.offset_m * beam.transmit.x_per_sine) / range_m;
  VF sum = set(0.0f), moment = set(0.0f);
  for (std::size_t i = 0; i < beam.sample_count; ++i) {
    const BeamSample& sample = beam.samples[i];
    const VF sine_off = cosine * set(sample.sin_azimuth);
    const VF transmitted =
        array_value(beam.transmit, row, fma(sine_off, set(beam.transmit.x_per_sine), sent_x));
    // This holds for many samples of planes that only the near field reaches.
    if (hn::AllTrue(f, transmitted == set(0.0f))) continue;
    const VF received = beam.steady && beam.same_arrays
                            ? transmitted
                            : array_value(beam.receive, heard_row,
                                          (sine_off + shift) * set(beam.receive.x_per_sine));
    sum = fma(transmitted * received, set(sample.width_rad), sum);
    if (lopsided)
      moment = fma(transmitted * received,
                   set(sample.width_rad * (sample.sin_azimuth - beam.sin_azimuth)), moment);
  }
  aside = lopsided ? hn::IfThenElseZero(sum > set(0.0f), moment / sum) : set(0.0f);
  return cosine * sent * (heard * sum) * (row.scale * heard_row.scale);
}

// scatter::BackscatterTable::sigma_over_sine. `falls` is for a plane facet, on which the sine of
// the grazing angle is proportional to 1 / range. There sigma / sine, times the elevation per metre
// of range, is proportional to range^-falls.
HWY_INLINE VF sigma_over_sine(const float* strengths, VI from, VF sine, VF cosine2, VF& falls) {
  using namespace scatter::backscatter_cells;
  const VF tangent2 =
      hn::Max(set(float(lowest)), hn::Min(set(float(highest)), sine * sine / cosine2));
  constexpr int shift = 23 - cells_per_octave_bits;
  const VI bits = hn::BitCast(i32, tangent2);
  const VI lowest_cell = hn::BitCast(i32, set(float(lowest)));
  const VI cell = from + hn::ShiftRight<shift>(bits - lowest_cell);
  const VI significand = hn::Set(i32, (1 << 23) - 1);
  const VI one = hn::BitCast(i32, set(1.0f));
  const VI fraction = hn::And(hn::ShiftLeft<cells_per_octave_bits>(bits), significand);
  const VF place = hn::BitCast(f, hn::Or(fraction, one)) - set(1.0f);
  const auto [begin, end] = neighbours(strengths, cell);
  const VF rise = end - begin;
  const VF value = fma(place, rise, begin);
  const VF mantissa = hn::BitCast(f, hn::Or(hn::And(bits, significand), one));
  constexpr auto twice_cells = static_cast<float>(2 << cells_per_octave_bits);
  const VF by_tangent2 = rise * mantissa * set(twice_cells) / hn::Max(value, set(1e-30f));
  falls = set(1.0f) + (by_tangent2 + set(1.0f)) / cosine2;
  return value;
}

template <class Tag>
HWY_INLINE hn::Vec<Tag> load(Tag tag, const std::uint32_t* from) {
  return hn::LoadU(tag, reinterpret_cast<const std::int32_t*>(from));
}

// Cosine and sine of the elevation in the middle of rays [begin, end), and the elevation from their
// first end to their last.
struct Middle {
  V cosine, sine, width;
};
HWY_INLINE Pair<V> cosine_and_sine(const RayAngles& rays, VJ angle) {
  return gather_pair(d, &rays.directions->cosine, hn::PromoteTo(i64, angle + angle));
}
HWY_INLINE Middle middle_of(const RayAngles& rays, VJ begin, VJ end) {
  const auto [cosine, sine] = cosine_and_sine(rays, begin + end - hn::Set(j32, 1));
  return {cosine, sine,
          hn::GatherIndex(d, rays.edge_rad, hn::PromoteTo(i64, end)) -
              hn::GatherIndex(d, rays.edge_rad, hn::PromoteTo(i64, begin))};
}

// Adds the change of the beam from the piece before to the piece behind to the slope of energy, if
// the three pieces are neighbours and their beam weights are similar.
void add_slope_of_beam(const PieceGeometry& pieces, const PieceEchoes& out) {
  const VF half = set(0.5f), one = set(1.0f);
  for (std::size_t i = 1; i + 1 < pieces.count; i += wide) {
    const float* weight = out.beam_weight + i;
    const float* width = out.width_rad + i;
    const VF here = hn::LoadU(f, weight);
    const VF change = hn::LoadU(f, weight + 1) - hn::LoadU(f, weight - 1);
    const VF widths =
        fma(half, hn::LoadU(f, width - 1) + hn::LoadU(f, width + 1), hn::LoadU(f, width));
    const auto neighbours = hn::And(load(i32, pieces.end + i - 1) == load(i32, pieces.begin + i),
                                    load(i32, pieces.end + i) == load(i32, pieces.begin + i + 1));
    const auto answer = hn::And(hn::LoadU(i32, out.answers + i - 1),
                                hn::LoadU(i32, out.answers + i + 1)) > hn::Zero(i32);
    const auto slight = hn::Abs(change) < half * here;
    const auto use = hn::And(hn::RebindMask(f, hn::And(neighbours, answer)), slight);
    const VF share = change * hn::LoadU(f, width) / hn::IfThenElse(use, here * widths, one);
    const VF before = hn::LoadU(f, out.energy_slope + i);
    const VF slope = clamp(before + hn::IfThenElseZero(use, share), hn::Neg(one), one);
    const auto within = hn::FirstN(f, pieces.count - 1 - i);
    hn::StoreU(hn::IfThenElse(within, slope, before), f, out.energy_slope + i);
  }
}

// Computes where pieces meet, and finds the pieces that may break off. If two facets meet between
// two rays, their ranges differ by no more than the range changes along one of the facets from ray
// to ray. Twice this change is allowed, because small facets may lie between them. This is enough
// if the places of two rays are no farther apart than two bins. SurfaceWalk looks at the others.
std::size_t find_breaks(const PieceKernelArgs& in, const PieceEchoes& out) {
  const PieceGeometry& pieces = in.pieces;
  std::size_t count = 0;
  out.breaks[count++] = 0;
  for (std::size_t i = 1; i < pieces.count; i += lanes) {
    const auto at = [&](const double* column, std::size_t k)
                        HWY_ATTR { return hn::LoadU(d, column + k); };
    const V last_m = at(out.range_m, i - 1) + at(out.to_last_m, i - 1);
    const V first_m = at(out.range_m, i) - at(out.to_last_m, i);
    const V meets_m = set(0.5) * (last_m + first_m);
    hn::StoreU(meets_m, d, out.from_m + i);
    hn::StoreU(meets_m, d, out.until_m + i - 1);

    const VH apart_m = hn::Abs(hn::DemoteTo(h, first_m - last_m));
    const auto half_step_m = [&](std::size_t k) HWY_ATTR {
      return hn::Abs(hn::DemoteTo(h, at(out.to_end_m, k) - at(out.to_last_m, k)));
    };
    const VH step_rad =
        hn::Max(hn::LoadU(h, out.ray_step_rad + i - 1), hn::LoadU(h, out.ray_step_rad + i));
    const VH places_apart_m = fma(hn::DemoteTo(h, last_m), step_rad, apart_m);
    const auto near =
        hn::And(apart_m <= hn::Set(h, 4.0f) * hn::Max(half_step_m(i - 1), half_step_m(i)),
                places_apart_m <= hn::Set(h, static_cast<float>(2.0 * in.bin_m)));
    const auto same_face = load(j32, pieces.index + i - 1) == load(j32, pieces.index + i);
    const auto neighbours = load(j32, pieces.end + i - 1) == load(j32, pieces.begin + i);
    const auto answer = hn::And(hn::LoadU(j32, out.answers + i - 1),
                                hn::LoadU(j32, out.answers + i)) > hn::Zero(j32);
    const auto sure = hn::And(hn::RebindMask(h, hn::And(neighbours, answer)),
                              hn::Or(hn::RebindMask(h, same_face), near));
    const auto broken = hn::AndNot(sure, hn::FirstN(h, pieces.count - i));
    if (hn::AllFalse(h, broken)) continue;
    const unsigned bits = bits_of(h, broken);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      out.breaks[count] = static_cast<std::uint32_t>(i + lane);
      count += bits >> lane & 1;
    }
  }
  return count;
}

// The middles of some pieces, from the plane's elevations in doubles.
struct Places {
  Middle at[halves];
  Halves range_m, to_end_m, grazing_sine, turning;
  hn::Mask<D> answers[halves];
};
HWY_INLINE Places places_of(const PieceKernelArgs& in, std::size_t first) {
  const V zero = hn::Zero(d), one = set(1.0);
  Places places;
  for (std::size_t half = 0; half < halves; ++half) {
    const std::size_t i = first + half * lanes;
    places.at[half] =
        middle_of(in.rays, load(j32, in.pieces.begin + i), load(j32, in.pieces.end + i));
    const auto& [cosine, sine, width] = places.at[half];
    const V level = hn::LoadU(d, in.pieces.level + i), pole = hn::LoadU(d, in.pieces.pole + i);
    // range = distance / facing, and facing is minus the grazing angle's sine.
    const V facing = fma(level, cosine, pole * sine);
    const V turning = pole * cosine - level * sine;  // d facing / d elevation
    const auto front = facing < set(-1e-9);
    const V inverse = one / hn::IfThenElse(front, facing, set(-1.0));
    const V found_m = hn::LoadU(d, in.pieces.distance + i) * inverse;
    const auto answers = hn::And(front, hn::And(found_m > zero, found_m <= set(2.0 * in.range_m)));
    const V range_m = hn::IfThenElse(answers, found_m, set(in.range_m));
    // How the range grows on one facet over half the piece, limited to what a straight line can
    // describe.
    const V limit_m = set(0.25) * range_m;
    const V to_end_m = range_m * turning * (inverse * (set(-0.5) * width));
    places.range_m.of[half] = range_m;
    places.to_end_m.of[half] = hn::Max(hn::Min(to_end_m, limit_m), hn::Neg(limit_m));
    places.grazing_sine.of[half] = hn::Min(hn::Max(hn::Neg(facing), zero), one);
    places.turning.of[half] = turning;
    places.answers[half] = answers;
  }
  return places;
}

// Stores the places and grazing angles at the middles of one half, and their changes over the
// piece.
HWY_INLINE void store_middles(const PieceKernelArgs& in, const PieceEchoes& out, std::size_t i,
                              const Middle& at, V range_m, V to_end_m, V grazing,
                              V grazing_change) {
  const V out_m = range_m * at.cosine, up_m = range_m * at.sine;
  const V growth_m = to_end_m + to_end_m;
  const V out_change_m = fma(growth_m, at.cosine, hn::Neg(at.width * up_m));
  const V up_change_m = fma(growth_m, at.sine, at.width * out_m);
  const auto axis = [&](std::size_t k, V level_m, V pole_m) HWY_ATTR {
    return fma(level_m, set(in.direction[k]), pole_m * set(in.pole_direction[k]));
  };
  hn::StoreInterleaved4(axis(0, out_m, up_m), axis(1, out_m, up_m), axis(2, out_m, up_m), grazing,
                        d, out.middles + 4 * i);
  hn::StoreInterleaved4(axis(0, out_change_m, up_change_m), axis(1, out_change_m, up_change_m),
                        axis(2, out_change_m, up_change_m), grazing_change, d, out.changes + 4 * i);
}

}  // namespace

std::size_t compute_echoes(const PieceKernelArgs& in, const PieceEchoes& out) {
  const PieceGeometry& pieces = in.pieces;
  const VF zero = set(0.0f), one = set(1.0f);
  for (std::size_t first = 0; first < pieces.count; first += wide) {
    const Places places = places_of(in, first);
    const auto narrow = [&](auto of) HWY_ATTR { return narrowed(each_half(of)); };
    const VF cosine = narrow([&](std::size_t half) HWY_ATTR { return places.at[half].cosine; });
    const VF sine = narrow([&](std::size_t half) HWY_ATTR { return places.at[half].sine; });
    const VF width_rad = narrow([&](std::size_t half) HWY_ATTR { return places.at[half].width; });
    const VF rest =
        narrow([&](std::size_t half) HWY_ATTR { return set(1.0) - places.grazing_sine.of[half]; });
    const VF range_m = narrowed(places.range_m), to_end_m = narrowed(places.to_end_m);
    const VF grazing_sine = narrowed(places.grazing_sine);
    const VF grazing_cosine2 = hn::Max(rest * (one + grazing_sine), set(1e-9f));
    const VF grazing_change =
        hn::Neg(narrowed(places.turning) * width_rad / hn::Sqrt(grazing_cosine2));

    VF aside;
    const VF weight = two_way(in.beam, range_m, cosine, sine, aside);
    hn::StoreU(range_m * cosine * aside, f, out.aside_m + first);
    VF falls;
    const VF strength = sigma_over_sine(in.strengths, hn::LoadU(i32, pieces.strengths_from + first),
                                        grazing_sine, grazing_cosine2, falls);
    const VF per_m = one / range_m;
    const VF energy = weight * strength * (per_m * per_m * width_rad);
    const VF slope = (set(-2.0f) - falls) * ((to_end_m + to_end_m) * per_m);
    const VF per_ray =
        one / hn::ConvertTo(f, load(i32, pieces.end + first) - load(i32, pieces.begin + first));
    hn::StoreU(clamp(slope, set(-1.0f), one), f, out.energy_slope + first);
    hn::StoreU(width_rad, f, out.width_rad + first);
    hn::StoreU(width_rad * per_ray, f, out.ray_step_rad + first);

    const Halves half_step_m = widened(to_end_m * per_ray), energies = widened(energy),
                 weights = widened(hn::Max(weight, zero)),
                 grazing = widened(arcsine(grazing_sine, rest)),
                 grazing_changes = widened(grazing_change);
    for (std::size_t half = 0; half < halves; ++half) {
      const std::size_t i = first + half * lanes;
      const V middle_m = places.range_m.of[half], end_m = places.to_end_m.of[half];
      const auto answers = places.answers[half];
      hn::StoreU(middle_m, d, out.range_m + i);
      hn::StoreU(end_m, d, out.to_end_m + i);
      hn::StoreU(end_m - half_step_m.of[half], d, out.to_last_m + i);
      hn::StoreU(hn::IfThenElseZero(answers, energies.of[half]), d, out.energy + i);
      hn::StoreU(hn::DemoteTo(h, hn::IfThenElseZero(answers, weights.of[half])), h,
                 out.beam_weight + i);
      hn::StoreU(hn::DemoteTo(j32, hn::IfThenElseZero(answers, set(1.0))), j32, out.answers + i);
      store_middles(in, out, i, places.at[half], middle_m, end_m, grazing.of[half],
                    grazing_changes.of[half]);
    }
  }
  add_slope_of_beam(pieces, out);
  return find_breaks(in, out);
}

void limit_runs(const RunLimitArgs& in, std::uint32_t* max_rays) {
  for (std::size_t i = 0; i < in.count; i += lanes) {
    const auto within = hn::FirstN(j32, in.count - i);
    const VJ begin = hn::IfThenElse(within, load(j32, in.begin + i), hn::Zero(j32));
    const VJ end = hn::IfThenElse(within, load(j32, in.end + i), hn::Set(j32, 1));
    const auto [cosine, sine, width] = middle_of(in.rays, begin, end);
    const V level = hn::LoadU(d, in.level + i), pole = hn::LoadU(d, in.pole + i);
    // As in places_of: the range is proportional to 1 / facing.
    const V facing = fma(level, cosine, pole * sine);
    const V turning = pole * cosine - level * sine;
    const V growth = hn::Abs(turning * width);
    const V max_growth = set(in.max_growth) * hn::Abs(facing);
    const V share = hn::IfThenElse(growth > max_growth, max_growth / growth, set(1.0));
    const V rays = hn::ConvertTo(d, hn::PromoteTo(i64, end - begin));
    const VJ few = hn::DemoteTo(j32, hn::Max(rays * share, set(1.0)));
    hn::StoreU(few, j32, reinterpret_cast<std::int32_t*>(max_rays + i));
  }
}

void shift_ranges(const RangeShiftArgs& in, double* from_m, double* until_m) {
  for (std::size_t i = 0; i < in.count; i += lanes) {
    const auto within = hn::FirstN(j32, in.count - i);
    const auto shift = [&](const std::uint32_t* rays, double* range_m) HWY_ATTR {
      // Halfway between rays j - 1 and j, where neighbouring pieces meet, it is angle 2 j - 1.
      const VJ ray = hn::IfThenElseZero(within, load(j32, rays + i));
      const auto [cosine, sine] =
          cosine_and_sine(in.rays, hn::Max(ray + ray - hn::Set(j32, 1), hn::Zero(j32)));
      const V drift = set(in.drift_level) * cosine + set(in.drift_pole) * sine;
      const V there = hn::LoadU(d, range_m + i);
      hn::StoreU(there - (set(0.5) * there + set(in.closing_shift_m)) * drift, d, range_m + i);
    };
    shift(in.begin, from_m);
    shift(in.end, until_m);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(limit_runs);
HWY_EXPORT(shift_ranges);
HWY_EXPORT(compute_echoes);

std::size_t compute_echoes(const PieceKernelArgs& in, const PieceEchoes& out) {
  return HWY_DYNAMIC_DISPATCH(compute_echoes)(in, out);
}
void limit_runs(const RunLimitArgs& in, std::uint32_t* max_rays) {
  HWY_DYNAMIC_DISPATCH(limit_runs)(in, max_rays);
}
void shift_ranges(const RangeShiftArgs& in, double* from_m, double* until_m) {
  HWY_DYNAMIC_DISPATCH(shift_ranges)(in, from_m, until_m);
}

}  // namespace ensonify::engine
#endif
