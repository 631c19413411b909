// Compiled once for each of Highway's targets. All of them do the same operations on each number, fused
// multiply-adds included, so their results are the same to the last bit; targets without fused ones are
// left out, down to plain code with std::fma.

#define HWY_BROKEN_EMU128 1  // so that plain code is the last resort with any compiler
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/trace/fan_kernel.cpp"
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_SSE4 | HWY_EMU128 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#include <hwy/foreach_target.h>

#include <cmath>

#include <hwy/highway.h>

#include <ensonify/engine/trace/fan_kernel.h>
#include <ensonify/engine/trace/fan_vectors.inc>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

using F = hn::ScalableTag<float>;

constexpr std::int64_t block_faces = 16;
static_assert(block_faces % lanes == 0);

constexpr float nearest_of_all = 1e30f;  // 1 / t of a hit at the origin itself
constexpr double in_the_plane = 1e-30;   // metres from the origin

// How far a point is from a plane of the fan. One computation for all who ask, so that all agree on
// which side of the plane a place is.
HWY_INLINE V off_plane(V sin_azimuth, V cos_azimuth, V x, V y) {
  const V back = hn::Mul(sin_azimuth, y);
#if HWY_TARGET == HWY_SCALAR
  return fma(cos_azimuth, x, hn::Neg(back));
#else
  return hn::MulSub(cos_azimuth, x, back);
#endif
}
HWY_INLINE V along_plane(V sin_azimuth, V cos_azimuth, V x, V y) {
  return fma(cos_azimuth, y, hn::Mul(sin_azimuth, x));
}

// A block may be met if it is within range, and for some plane on both of its sides and not behind.
void find_blocks_here(FanPass& pass) {
  const Frame frame = frame_of(&pass.origin[0], &pass.axes[0]);
  const V range2 = hn::Set(d, pass.range_m * pass.range_m);
  const V wider = hn::Set(d, 1.0 + 1e-12), rounding = hn::Set(d, 1e-14), zero = hn::Zero(d);
  std::int64_t met = 0;
  for (std::int64_t block = 0; block < pass.blocks; block += lanes) {
    const float* box = pass.boxes + block;
    const std::int64_t row = pass.boxes_in_row;
    const V3 middle{promoted(box), promoted(box + row), promoted(box + 2 * row)};
    const V3 half{promoted(box + 3 * row), promoted(box + 4 * row), promoted(box + 5 * row)};
    const V3 from = middle - frame.origin;
    const V3 away{hn::Abs(from.x), hn::Abs(from.y), hn::Abs(from.z)};
    const V3 gap = away - half;
    const V3 least{hn::Max(gap.x, zero), hn::Max(gap.y, zero), hn::Max(gap.z, zero)};
    const M in_range = hn::Le(dot(least, least), hn::Mul(range2, wider));
    if (hn::AllFalse(d, in_range)) continue;

    const auto reach = [&](const V3& axis) HWY_ATTR {
      return dot({hn::Abs(axis.x), hn::Abs(axis.y), hn::Abs(axis.z)}, half);
    };
    const V slack = hn::Mul(rounding, hn::Add(hn::Add(hn::Add(away.x, away.y), away.z),
                                              hn::Add(hn::Add(half.x, half.y), half.z)));
    const V x = dot(frame.array, from), y = dot(frame.middle, from);
    const V reach_x = fma(reach(frame.array), wider, slack);
    const V reach_y = fma(reach(frame.middle), wider, slack);
    M meets = hn::Lt(zero, zero);
    for (std::int64_t k = 0; k < pass.planes; ++k) {
      const V sine = hn::Set(d, pass.sin_azimuth[k]), cosine = hn::Set(d, pass.cos_azimuth[k]);
      const V off = hn::Abs(off_plane(sine, cosine, x, y));
      const V off_reach = fma(hn::Abs(cosine), reach_x, hn::Mul(hn::Abs(sine), reach_y));
      const V along = along_plane(sine, cosine, x, y);
      const V along_reach = fma(hn::Abs(cosine), reach_y, hn::Mul(hn::Abs(sine), reach_x));
      meets = hn::Or(meets, hn::And(hn::Le(off, off_reach), hn::Ge(along, hn::Neg(along_reach))));
    }
    alignas(8) std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, hn::And(meets, in_range), bits);
    for (std::int64_t i = 0; i < lanes && block + i < pass.blocks; ++i) {
      pass.met_blocks[met] = static_cast<std::uint32_t>(block + i);
      met += bits[0] >> i & 1;
    }
  }
  pass.met = met;
}

// What is common to all rays that a face meets. With a, b, c its corners from the origin, N its normal
// (b - a) x (c - a) and d a ray's direction, the ray meets the face's plane at t = (N.a) / (N.d), and
// the point there weighs b by d.((c - a) x a) / (N.d), c by d.(a x (b - a)) / (N.d) and a by the rest.
// All signs are turned so that N.a >= 0.
HWY_INLINE void prepare_faces(const FanPass& pass, FanBatch& batch, std::int64_t slot,
                              std::int64_t place, V turn, V3 a, V3 b, V3 c) {
  const V3 ab = b - a, ac = c - a, bc = c - b;
  const V zero = hn::Zero(d);
  V3 normal = cross(ab, ac), to_b = cross(ac, a), to_c = cross(a, ab);
  V distance = dot(normal, a);
  const V sign = hn::IfThenElse(hn::Lt(distance, zero), hn::Set(d, -1.0), hn::Set(d, 1.0));
  normal = sign * normal, to_b = sign * to_b, to_c = sign * to_c;
  distance = hn::Mul(sign, distance);
  const V3 to_a = normal - to_b - to_c;

  // The source's corners are the face's, turned.
  const M once = hn::Eq(turn, hn::Set(d, 1.0)), twice = hn::Eq(turn, hn::Set(d, 2.0));
  const V3 u = choose(once, to_a, choose(twice, to_c, to_b));
  const V3 v = choose(once, to_b, choose(twice, to_a, to_c));
  const V size = hn::Add(hn::Add(hn::Abs(normal.x), hn::Abs(normal.y)), hn::Abs(normal.z));
  const M apart = hn::Gt(distance, hn::Mul(hn::Set(d, in_the_plane), size));
  const V inverse =
      hn::IfThenElse(apart, hn::Div(hn::Set(d, 1.0), hn::IfThenElse(apart, distance, size)), zero);
  double* forms = pass.forms + 4 * slot;
  const std::int64_t step = 4 * pass.slots;
  hn::StoreInterleaved4(u.x, v.x, normal.x, distance, d, forms);
  hn::StoreInterleaved4(u.y, v.y, normal.y, inverse, d, forms + step);
  hn::StoreInterleaved4(u.z, v.z, normal.z, sign, d, forms + 2 * step);
  hn::StoreU(hn::IfThenElse(apart, zero, hn::Set(d, 1.0)), d, &batch.sees_origin[0] + place);
  batch.through_origin |= !hn::AllTrue(d, apart);
  const V3 scaled = inverse * normal;
  float* planes = &batch.planes[0] + place;
  hn::StoreU(hn::DemoteTo(df, scaled.x), df, planes);
  hn::StoreU(hn::DemoteTo(df, scaled.y), df, planes + batch_faces);
  hn::StoreU(hn::DemoteTo(df, scaled.z), df, planes + 2 * batch_faces);

  // No point of the face is farther than its farthest corner, nor nearer than that less the longest edge.
  const auto one = hn::Set(df, 1.0f);
  const auto far = hn::Sqrt(hn::DemoteTo(df, hn::Max(dot(a, a), hn::Max(dot(b, b), dot(c, c)))));
  const auto longest =
      hn::Sqrt(hn::DemoteTo(df, hn::Max(dot(ab, ab), hn::Max(dot(ac, ac), dot(bc, bc)))));
  const auto outer = hn::Mul(far, hn::Set(df, 1.0f + 0x1p-20f));
  const auto inner = hn::Sub(hn::Mul(far, hn::Set(df, 1.0f - 0x1p-20f)),
                             hn::Mul(longest, hn::Set(df, 1.0f + 0x1p-20f)));
  const auto apart_from = hn::Gt(inner, hn::Set(df, 1.0f / nearest_of_all));
  hn::StoreU(hn::Div(one, outer), df, planes + 3 * batch_faces);
  hn::StoreU(hn::IfThenElse(apart_from, hn::Div(one, hn::IfThenElse(apart_from, inner, one)),
                            hn::Set(df, nearest_of_all)),
             df, planes + 4 * batch_faces);
}

// A place where an edge crosses a plane: along the plane and along the pole, times a positive number.
// The edge's ends may come in either order.
struct Crossing {
  V x, y;
};
struct InPlane {
  V off, x, y;
};
HWY_INLINE InPlane choose(M mask, const InPlane& yes, const InPlane& no) {
  return {hn::IfThenElse(mask, yes.off, no.off), hn::IfThenElse(mask, yes.x, no.x),
          hn::IfThenElse(mask, yes.y, no.y)};
}
HWY_INLINE Crossing between(const InPlane& p, const InPlane& q) {
  const V weight_p = hn::Abs(q.off), weight_q = hn::Abs(p.off);
  return {hn::Add(hn::Mul(weight_p, p.x), hn::Mul(weight_q, q.x)),
          hn::Add(hn::Mul(weight_p, p.y), hn::Mul(weight_q, q.y))};
}

// The rows of a batch's list of one plane.
HWY_INLINE double* crossings_of(const FanBatch& batch, std::int64_t plane) {
  return batch.crossings + plane * FanBatch::list_rows * FanBatch::list_room;
}

// Brings one block into the fan's frame and lists where its faces cross which planes.
HWY_INLINE void cross_block(const FanPass& pass, const Frame& frame, FanBatch& batch,
                            std::int64_t met, std::int64_t place) {
  const float* rows =
      pass.block_rows + static_cast<std::int64_t>(pass.met_blocks[met]) * 10 * block_faces;
  const V zero = hn::Zero(d);
  const auto in_row = hn::Iota(di, 0);
  for (std::int64_t i = 0; i < block_faces; i += lanes, rows += lanes, place += lanes) {
    const auto corner = [&](std::int64_t k) HWY_ATTR {
      const float* at = rows + 3 * k * block_faces;
      return into(frame,
                  {promoted(at), promoted(at + block_faces), promoted(at + 2 * block_faces)});
    };
    const V3 a = corner(0), b = corner(1), c = corner(2);
    const V places = hn::BitCast(d, hn::Add(in_row, hn::Set(di, place)));
    bool any = false;
    for (std::int64_t k = 0; k < pass.planes; ++k) {
      const V sine = hn::Set(d, pass.sin_azimuth[k]), cosine = hn::Set(d, pass.cos_azimuth[k]);
      const V off_a = off_plane(sine, cosine, a.x, a.y), off_b = off_plane(sine, cosine, b.x, b.y),
              off_c = off_plane(sine, cosine, c.x, c.y);
      const M side_a = hn::Ge(off_a, zero), side_b = hn::Ge(off_b, zero),
              side_c = hn::Ge(off_c, zero);
      const M a_from_b = hn::Xor(side_a, side_b), a_from_c = hn::Xor(side_a, side_c);
      const M crosses = hn::Or(a_from_b, a_from_c);
      if (hn::AllFalse(d, crosses)) continue;
      any = true;
      const InPlane in_a{off_a, along_plane(sine, cosine, a.x, a.y), a.z},
          in_b{off_b, along_plane(sine, cosine, b.x, b.y), b.z},
          in_c{off_c, along_plane(sine, cosine, c.x, c.y), c.z};
      const M lone_b = hn::Not(a_from_c), lone_c = hn::Not(a_from_b);
      const InPlane lone = choose(lone_b, in_b, choose(lone_c, in_c, in_a));
      const Crossing p = between(lone, choose(lone_b, in_a, in_b));
      const Crossing q = between(lone, choose(lone_c, in_a, in_c));
      std::int64_t& count = batch.counts[k];
      double* const list = crossings_of(batch, k) + count;
      const auto note = [&](std::int64_t row, V values) HWY_ATTR {
        hn::CompressStore(values, crosses, d, list + row * FanBatch::list_room);
      };
      note(0, p.x), note(1, p.y), note(2, q.x), note(3, q.y), note(4, places);
      count += static_cast<std::int64_t>(hn::CountTrue(d, crosses));
    }
    if (any)
      prepare_faces(pass, batch, met * block_faces + i, place, promoted(rows + 9 * block_faces), a,
                    b, c);
  }
}

// A crossing's place among the elevations (fan_tables.h), if it is in front.
HWY_INLINE V order_of(M in_front, const Crossing& at) {
  const V across = hn::IfThenElse(in_front, hn::Add(at.x, hn::Abs(at.y)), hn::Set(d, 1.0));
  return hn::Div(hn::IfThenElseZero(in_front, at.y), across);
}

// How many of the plane's rays are below a crossing: a function of the crossing alone, so that faces
// that share it share the answer. First a guess: one ray decides whether it or one more is right, but
// where it says that it may be far off.
HWY_INLINE V guess_below(const FanPass& pass, V order) {
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
  const V stepped = hn::Max(
      hn::Mul(hn::Sub(order, hn::Set(d, pass.first_q)), hn::Set(d, pass.steps_per_q)), zero);
  const auto step = hn::ConvertTo(di, hn::Min(stepped, hn::Set(d, pass.steps - 1.0)));
  const V fraction = hn::Min(hn::Sub(stepped, hn::ConvertTo(d, step)), one);
  return fma(fraction, hn::GatherIndex(d, pass.rise, step), hn::GatherIndex(d, pass.below, step));
}
HWY_INLINE void find_below(const FanPass& pass, V p_order, V q_order, hn::Vec<I>& p,
                           hn::Vec<I>& q) {
  V p_guess = guess_below(pass, p_order), q_guess = guess_below(pass, q_order);
  const V far_off = hn::Set(d, FanPass::far_off), none = hn::Zero(d);
  const M p_far = hn::Ge(p_guess, far_off), q_far = hn::Ge(q_guess, far_off);
  const bool all_near = hn::AllFalse(d, hn::Or(p_far, q_far));
  // A mask's lanes are -1 as integers.
  const auto number = [](M mask) HWY_ATTR { return hn::BitCast(di, hn::VecFromMask(d, mask)); };
  if (HWY_LIKELY(all_near)) {
    p = hn::ConvertTo(di, p_guess);
    q = hn::ConvertTo(di, q_guess);
    p = hn::Sub(p, number(hn::Lt(hn::GatherIndex(d, pass.ascending + 1, p), p_order)));
    q = hn::Sub(q, number(hn::Lt(hn::GatherIndex(d, pass.ascending + 1, q), q_order)));
    return;
  }
  p = hn::ConvertTo(di, hn::Sub(p_guess, hn::IfThenElse(p_far, far_off, none)));
  q = hn::ConvertTo(di, hn::Sub(q_guess, hn::IfThenElse(q_far, far_off, none)));
  for (;;) {
    const M p_fewer = hn::Ge(hn::GatherIndex(d, pass.ascending, p), p_order);
    const M q_fewer = hn::Ge(hn::GatherIndex(d, pass.ascending, q), q_order);
    const M p_more = hn::Lt(hn::GatherIndex(d, pass.ascending + 1, p), p_order);
    const M q_more = hn::Lt(hn::GatherIndex(d, pass.ascending + 1, q), q_order);
    if (hn::AllFalse(d, hn::Or(hn::Or(p_fewer, p_more), hn::Or(q_fewer, q_more)))) return;
    p = hn::Add(p, hn::Sub(number(p_fewer), number(p_more)));
    q = hn::Add(q, hn::Sub(number(q_fewer), number(q_more)));
  }
}

// The face takes those of rays [from, until) of a plane to which it is nearer than all before it. Of
// faces at one distance the first keeps the ray.
struct Taker {
  float x, y, least, greatest;  // 1 / t = x cos(elevation) + y sin(elevation)
  std::uint32_t slot;
};
HWY_INLINE void take_row(const FanPass& pass, std::int64_t plane, std::int64_t from,
                         std::int64_t until, const Taker& face) {
  constexpr F f;
  constexpr hn::RebindToUnsigned<F> u;
  constexpr auto width = static_cast<std::int64_t>(hn::MaxLanes(f));
  float* nearness = pass.nearness + plane * pass.stride;
  std::uint32_t* nearest = pass.nearest + plane * pass.stride;
  const auto x = hn::Set(f, face.x), y = hn::Set(f, face.y);
  const auto least = hn::Set(f, face.least), greatest = hn::Set(f, face.greatest);
  const auto slot = hn::Set(u, face.slot);
  for (std::int64_t j = from; j < until; j += width) {
    const auto cosine = hn::LoadU(f, pass.cos_elevation_rounded + j);
    const auto sine = hn::LoadU(f, pass.sin_elevation_rounded + j);
    const auto plain = fma(f, x, cosine, hn::Mul(y, sine));
    const auto w = hn::Min(hn::Max(plain, least), greatest);
    const auto old = hn::LoadU(f, nearness + j);
    const auto wins = hn::And(hn::Gt(w, old), hn::FirstN(f, static_cast<std::size_t>(until - j)));
    hn::StoreU(hn::IfThenElse(wins, w, old), f, nearness + j);
    hn::StoreU(hn::IfThenElse(hn::RebindMask(u, wins), slot, hn::LoadU(u, nearest + j)), u,
               nearest + j);
  }
}

// The same, but for rays outside the beam.
HWY_INLINE void take_rays(const FanPass& pass, std::int64_t plane, std::int64_t from,
                          std::int64_t until, const Taker& face) {
  const std::int64_t first = pass.left_out_from[plane], last = pass.left_out_until[plane];
  if (from < first) take_row(pass, plane, from, until < first ? until : first, face);
  if (until > last) take_row(pass, plane, from > last ? from : last, until, face);
}

// A face that goes through the origin meets all of a plane's rays there, but those that lie in it.
HWY_INLINE void take_at_origin(const FanPass& pass, std::int64_t plane, double own, Taker face) {
  face.least = face.greatest = nearest_of_all;
  const double* order = pass.ascending + 1;
  std::int64_t below = 0;
  while (below < pass.elevations && order[below] < own) ++below;
  std::int64_t above = below;
  while (above < pass.elevations && order[above] == own) ++above;
  take_rays(pass, plane, 0, below, face);
  take_rays(pass, plane, above, pass.elevations, face);
}

// What a face of the batch lays over a plane's rays.
HWY_INLINE Taker taker_of(const FanPass& pass, const FanBatch& batch, std::int64_t plane,
                          std::int64_t place, std::int64_t first_slot) {
  const float* face = &batch.planes[0] + place;
  const float sine = static_cast<float>(pass.sin_azimuth[plane]);
  const float cosine = static_cast<float>(pass.cos_azimuth[plane]);
  return {std::fma(face[0], sine, face[batch_faces] * cosine), face[2 * batch_faces],
          face[3 * batch_faces], face[4 * batch_faces],
          static_cast<std::uint32_t>(first_slot + place)};
}

// Turns a plane's list of crossings into one of the rays between them: in its first row the first ray,
// and in the upper half the one behind the last; in its second the face. Those without rays drop out.
HWY_INLINE void find_intervals(const FanPass& pass, FanBatch& batch, std::int64_t plane,
                               std::int64_t first_slot) {
  const V zero = hn::Zero(d);
  const auto all = hn::Set(di, pass.elevations);
  const std::int64_t count = batch.counts[plane];
  double* const rows = crossings_of(batch, plane);
  constexpr std::int64_t room = FanBatch::list_room;
  for (std::int64_t row = 0; row < FanBatch::list_rows; ++row)  // fills the last vector
    hn::StoreU(hn::Set(d, rows[row * room]), d, rows + row * room + count);
  std::int64_t intervals = 0;
  for (std::int64_t first = 0; first < count; first += lanes) {
    const double* at = rows + first;
    const Crossing p{hn::LoadU(d, at), hn::LoadU(d, at + room)};
    const Crossing q{hn::LoadU(d, at + 2 * room), hn::LoadU(d, at + 3 * room)};
    const V places = hn::LoadU(d, at + 4 * room);

    // Behind the pole there are no rays. A face that goes there passes over all rays above the crossing
    // in front, or over all below it.
    const M p_front = hn::Gt(p.x, zero), q_front = hn::Gt(q.x, zero);
    const V p_order = order_of(p_front, p), q_order = order_of(q_front, q);
    hn::Vec<I> p_rays, q_rays;
    find_below(pass, p_order, q_order, p_rays, q_rays);
    if (HWY_UNLIKELY(!hn::AllTrue(d, hn::And(p_front, q_front)))) {
      const V turn = hn::Sub(hn::Mul(p.x, q.y), hn::Mul(p.y, q.x));
      const auto p_end =
          hn::IfThenElseZero(hn::RebindMask(di, hn::And(q_front, hn::Lt(turn, zero))), all);
      const auto q_end =
          hn::IfThenElseZero(hn::RebindMask(di, hn::And(p_front, hn::Gt(turn, zero))), all);
      p_rays = hn::IfThenElse(hn::RebindMask(di, p_front), p_rays, p_end);
      q_rays = hn::IfThenElse(hn::RebindMask(di, q_front), q_rays, q_end);
    }
    const auto from = hn::Min(p_rays, q_rays), until = hn::Max(p_rays, q_rays);
    M some = hn::And(hn::RebindMask(d, hn::Lt(from, until)),
                     hn::FirstN(d, static_cast<std::size_t>(count - first)));

    if (HWY_UNLIKELY(batch.through_origin)) {
      const V size =
          hn::Max(hn::Max(hn::Abs(p.x), hn::Abs(p.y)), hn::Max(hn::Abs(q.x), hn::Abs(q.y)));
      const V sees = hn::GatherIndex(d, &batch.sees_origin[0], hn::BitCast(di, places));
      const M at_origin =
          hn::And(hn::Gt(sees, zero),
                  hn::And(hn::Le(fma(p.x, q.x, hn::Mul(p.y, q.y)), zero), hn::Gt(size, zero)));
      const M take_p = hn::Ne(p.x, zero);
      const V x = hn::IfThenElse(take_p, p.x, q.x), y = hn::IfThenElse(take_p, p.y, q.y);
      const M behind = hn::Lt(x, zero), along_pole = hn::Eq(x, zero);
      const V order =
          order_of(hn::Not(along_pole), {hn::Abs(x), hn::IfThenElse(behind, hn::Neg(y), y)});
      alignas(64) double own[lanes];
      alignas(64) std::int64_t place[lanes];
      std::uint8_t through[8] = {};
      hn::Store(hn::IfThenElse(along_pole, hn::Set(d, 3.0), order), d, own);
      hn::Store(hn::BitCast(di, places), di, place);
      hn::StoreMaskBits(d, at_origin, through);
      for (std::int64_t i = 0; i < lanes && first + i < count; ++i)
        if (through[0] >> i & 1)
          take_at_origin(pass, plane, own[i], taker_of(pass, batch, plane, place[i], first_slot));
      some = hn::AndNot(at_origin, some);
    }
    const V interval = hn::BitCast(d, hn::Or(from, hn::ShiftLeft<32>(until)));
    hn::CompressStore(interval, some, d, rows + intervals);
    hn::CompressStore(places, some, d, rows + room + intervals);
    intervals += static_cast<std::int64_t>(hn::CountTrue(d, some));
  }
  batch.counts[plane] = intervals;
}

// Plane after plane by turns: a row's next face comes when what the last wrote there can be read again.
HWY_INLINE void take_intervals(const FanPass& pass, FanBatch& batch, std::int64_t first_slot) {
  for (std::int64_t i = 0, left = 1; left > 0; ++i) {
    left = 0;
    for (std::int64_t k = 0; k < pass.planes; ++k) {
      if (i >= batch.counts[k]) continue;
      left += batch.counts[k] - i - 1;
      const double* at = crossings_of(batch, k) + i;
      const auto interval = __builtin_bit_cast(std::int64_t, at[0]);
      const auto place = __builtin_bit_cast(std::int64_t, at[FanBatch::list_room]);
      take_rays(pass, k, interval & 0xffffffff, interval >> 32,
                taker_of(pass, batch, k, place, first_slot));
    }
  }
}

void scan_faces_here(const FanPass& pass, FanBatch& batch) {
  const Frame frame = frame_of(&pass.origin[0], &pass.axes[0]);
  for (std::int64_t first = 0; first < pass.met; first += batch_blocks) {
    const std::int64_t end = first + batch_blocks < pass.met ? first + batch_blocks : pass.met;
    for (std::int64_t k = 0; k < pass.planes; ++k) batch.counts[k] = 0;
    batch.through_origin = false;
    for (std::int64_t met = first; met < end; ++met)
      cross_block(pass, frame, batch, met, (met - first) * block_faces);
    for (std::int64_t k = 0; k < pass.planes; ++k)
      if (batch.counts[k] > 0) find_intervals(pass, batch, k, first * block_faces);
    take_intervals(pass, batch, first * block_faces);
  }
}

}  // namespace

// What is exported must not be unnamed.
void find_blocks_on(FanPass& pass) { find_blocks_here(pass); }
void scan_faces_on(const FanPass& pass, FanBatch& batch) { scan_faces_here(pass, batch); }

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(find_blocks_on);
HWY_EXPORT(scan_faces_on);

void find_blocks(FanPass& pass) { HWY_DYNAMIC_DISPATCH(find_blocks_on)(pass); }
void scan_faces(const FanPass& pass, FanBatch& batch) {
  HWY_DYNAMIC_DISPATCH(scan_faces_on)(pass, batch);
}

}  // namespace ensonify::engine
#endif
