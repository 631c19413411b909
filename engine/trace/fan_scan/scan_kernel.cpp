// Compiled once per Highway target (vector_targets.h).

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/trace/fan_scan/scan_kernel.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <cmath>
#include <limits>

#include <hwy/highway.h>

#include <ensonify/engine/trace/fan_frame-inl.h>
#include <ensonify/engine/trace/fan_scan/crossings-inl.h>
#include <ensonify/engine/trace/fan_scan/precise_claim-inl.h>
#include <ensonify/engine/trace/fan_scan/scan_kernel.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

using F = hn::ScalableTag<float>;

constexpr std::int64_t block_faces = FaceBlocks::faces, block_rows = FaceBlocks::rows;
static_assert(block_faces % lanes == 0);
static_assert(FaceBlocks::together % lanes == 0);  // find_blocks() reads whole vectors of boxes
static_assert(lanes <= ScanBatch::list_room - batch_faces);
static_assert(hn::MaxLanes(F()) <= widest_vector);

// 1 / t in float has an error below 2^-21 of the sum of its plane's three terms. Where that sum is
// at most largest_sum times 1 / t, the error is below 2^-14 of 1 / t; faces seen more edge on are
// computed in double.
constexpr float largest_sum = 128.0f;
constexpr float surely_nearer = 1.0f - 0x1p-12f, maybe_nearer = 1.0f + 0x1p-12f;

// Computes what is common to all rays that meet a face. With a, b, c the face's corners from the
// origin, N its normal (b - a) x (c - a) and d a ray's direction, the ray meets the face's plane at
// t = (N.a) / (N.d). At that point the weight of b is d.((c - a) x a) / (N.d), that of c is
// d.(a x (b - a)) / (N.d), and a has the rest. All signs are chosen so that N.a >= 0.
HWY_INLINE void prepare_faces(const ScanArgs& args, ScanBatch& batch, std::int64_t first_candidate,
                              std::int64_t place, M within, const Corners& at) {
  const V3 a = at.a, b = at.b, c = at.c;
  const V3 ab = b - a, ac = c - a, bc = c - b;
  const V zero = hn::Zero(d);
  V3 normal = cross(ab, ac);
  V distance = dot(normal, a);
  const std::int64_t candidate = first_candidate + place;
  if (!args.hits_wanted) {
    const V turn = hn::Set(d, args.frame.handedness);
    const FacePlane face = face_plane(turn * normal, turn * distance);
    hn::StoreInterleaved4(face.normal.x, face.normal.y, face.normal.z, face.distance, d,
                          args.face_planes + 4 * candidate);
  }
  const V sign = hn::IfThenElse(hn::Lt(distance, zero), hn::Set(d, -1.0), hn::Set(d, 1.0));
  normal = sign * normal;
  distance = sign * distance;
  const V size = hn::Abs(normal.x) + hn::Abs(normal.y) + hn::Abs(normal.z);
  const M apart = hn::Gt(distance, hn::Set(d, in_the_plane) * size);
  const V inverse =
      hn::IfThenElse(apart, hn::Set(d, 1.0) / hn::IfThenElse(apart, distance, size), zero);
  if (args.hits_wanted) {
    const V3 to_b = sign * cross(ac, a), to_c = sign * cross(a, ab);
    const V3 to_a = normal - to_b - to_c;
    // The face's corners are the source's, rotated by `turn`.
    const V turn = promoted(&batch.rows[0] + FaceBlocks::turn_row * batch_room + place);
    const M once = hn::Eq(turn, hn::Set(d, 1.0)), twice = hn::Eq(turn, hn::Set(d, 2.0));
    const V3 u = choose(once, to_a, choose(twice, to_c, to_b));
    const V3 v = choose(once, to_b, choose(twice, to_a, to_c));
    double* forms = args.forms + 4 * candidate;
    const std::int64_t step = 4 * args.max_candidates;
    hn::StoreInterleaved4(u.x, v.x, normal.x, distance, d, forms);
    hn::StoreInterleaved4(u.y, v.y, normal.y, inverse, d, forms + step);
    hn::StoreInterleaved4(u.z, v.z, normal.z, zero, d, forms + 2 * step);
  }
  hn::StoreU(hn::IfThenElse(apart, zero, hn::Set(d, 1.0)), d, &batch.sees_origin[0] + place);
  batch.through_origin |= !hn::AllTrue(d, hn::Or(apart, hn::Not(within)));
  const V3 scaled = inverse * normal;
  float* planes = &batch.planes[0] + place;
  hn::StoreU(hn::DemoteTo(df, scaled.x), df, planes);
  hn::StoreU(hn::DemoteTo(df, scaled.y), df, planes + batch_room);
  hn::StoreU(hn::DemoteTo(df, scaled.z), df, planes + 2 * batch_room);

  // No point of the face is farther than its farthest corner, or nearer than that corner's distance
  // minus the longest edge.
  const auto one = hn::Set(df, 1.0f);
  const auto far = hn::Sqrt(hn::DemoteTo(df, hn::Max(dot(a, a), hn::Max(dot(b, b), dot(c, c)))));
  const auto longest =
      hn::Sqrt(hn::DemoteTo(df, hn::Max(dot(ab, ab), hn::Max(dot(ac, ac), dot(bc, bc)))));
  const auto outer = far * hn::Set(df, 1.0f + 0x1p-20f);
  const auto inner = far * hn::Set(df, 1.0f - 0x1p-20f) - longest * hn::Set(df, 1.0f + 0x1p-20f);
  const auto apart_from = hn::Gt(inner, hn::Set(df, 1.0f / nearest_of_all));
  const auto least = one / outer;
  const auto sum = hn::DemoteTo(df, hn::Abs(scaled.x) + hn::Abs(scaled.y) + hn::Abs(scaled.z));
  const auto on_edge = hn::Gt(sum, least * hn::Set(df, largest_sum));
  hn::StoreU(hn::IfThenElse(on_edge, hn::Neg(least), least), df, planes + 3 * batch_room);
  hn::StoreU(hn::IfThenElse(apart_from, one / hn::IfThenElse(apart_from, inner, one),
                            hn::Set(df, nearest_of_all)),
             df, planes + 4 * batch_room);
}

// The rows of one plane's list in a batch.
HWY_INLINE double* crossings_of(const ScanBatch& batch, std::int64_t plane) {
  return batch.crossings + plane * ScanBatch::list_rows * ScanBatch::list_room;
}

// Appends those faces of a block to the batch that may cross a plane of the fan, decided in float:
// in front of the pole a face covers the range of azimuths of its corners; x / y is the tangent.
//
// Coordinates relative to the origin have errors of 2^-24 of the origin's coordinates plus a few
// times 2^-24 of their own size. So x and y have errors below e = 2^-21 of the sum of both sizes.
// Where y is more than 2 e, the error of x / y is less than 2 e (1 + |x / y|) / y. Twice that is
// allowed, for rounding in this function.
HWY_INLINE void add_block(const ScanArgs& args, ScanBatch& batch, const MetBlock& met,
                          std::uint32_t* index) {
  constexpr F f;
  constexpr hn::RebindToUnsigned<F> u;
  constexpr auto width = static_cast<std::int64_t>(hn::MaxLanes(f));
  static_assert(block_faces % width == 0);
  using VF = hn::Vec<F>;
  const auto set = [&](double value) HWY_ATTR { return hn::Set(f, static_cast<float>(value)); };
  const double* o = &args.frame.origin[0];
  const double* axes = &args.frame.axes[0];
  const float origin_size = static_cast<float>(std::fabs(o[0]) + std::fabs(o[1]) + std::fabs(o[2]));
  const std::int64_t block = met.block;
  const float* rows = args.block_rows + block * block_rows * block_faces;
  for (std::int64_t i = 0; i < block_faces; i += width, rows += width) {
    VF min_y = set(0.0), least = min_y, greatest = min_y, size = min_y;
    const auto see = [&](std::int64_t corner) HWY_ATTR {
      const auto from = [&](std::int64_t axis) HWY_ATTR {
        return hn::LoadU(f, rows + (3 * corner + axis) * block_faces) - set(o[axis]);
      };
      const VF p = from(0), q = from(1), r = from(2);
      const auto along = [&](const double* axis) HWY_ATTR {
        return fma(set(axis[0]), p, fma(set(axis[1]), q, set(axis[2]) * r));
      };
      const VF x = along(axes), y = along(axes + 3), tangent = x / y;
      const VF far = hn::Abs(p) + hn::Abs(q) + hn::Abs(r);
      min_y = corner == 0 ? y : hn::Min(min_y, y);
      least = corner == 0 ? tangent : hn::Min(least, tangent);
      greatest = corner == 0 ? tangent : hn::Max(greatest, tangent);
      size = corner == 0 ? far : hn::Max(size, far);
    };
    see(0), see(1), see(2);
    const VF error = (size + hn::Set(f, origin_size)) * set(0x1p-21);
    const auto in_front = hn::Gt(min_y, error + error);
    const VF steepest = hn::Max(hn::Abs(least), hn::Abs(greatest));
    const VF slack = error * set(4.0) / min_y * (steepest + set(1.0));
    const VF from = least - slack, until = greatest + slack;
    auto may_cross = hn::Not(in_front);
    for (std::int64_t k = met.first_plane; k <= met.last_plane; ++k) {
      const VF tangent = hn::Set(f, args.tan_azimuth[k]);
      may_cross = hn::Or(may_cross, hn::And(hn::Ge(tangent, from), hn::Le(tangent, until)));
    }
    if (hn::AllFalse(f, may_cross)) continue;
    float* to = &batch.rows[0] + batch.count;
    const auto keep = [&](std::int64_t row, VF values)
                          HWY_ATTR { store_some(f, values, may_cross, to + row * batch_room); };
    for (std::int64_t row = 0; row < block_rows; ++row)
      keep(row, hn::LoadU(f, rows + row * block_faces));
    const VF lowest = hn::Set(f, met.lowest), highest = hn::Set(f, met.highest);
    keep(ScanBatch::min_tangent, hn::IfThenElse(in_front, hn::Max(from, lowest), lowest));
    keep(ScanBatch::max_tangent, hn::IfThenElse(in_front, hn::Min(until, highest), highest));
    const auto number =
        hn::Iota(u, 0) + hn::Set(u, static_cast<std::uint32_t>(block * block_faces + i));
    store_some(u, number, hn::RebindMask(u, may_cross), index + batch.count);
    batch.count += static_cast<std::int64_t>(hn::CountTrue(f, may_cross));
  }
}

// Transforms the batch's faces from `place` on into the fan's frame, and lists which planes they
// cross, and where.
HWY_INLINE void cross_faces(const ScanArgs& args, const Frame& frame, ScanBatch& batch,
                            std::int64_t first_candidate, std::int64_t place) {
  const V zero = hn::Zero(d);
  const auto corner = [&](std::int64_t k) HWY_ATTR {
    const float* at = &batch.rows[0] + 3 * k * batch_room + place;
    return into(frame, {promoted(at), promoted(at + batch_room), promoted(at + 2 * batch_room)});
  };
  const Corners at{corner(0), corner(1), corner(2)};
  const V3 a = at.a, b = at.b, c = at.c;
  const M within = hn::FirstN(d, static_cast<std::size_t>(batch.count - place));
  prepare_faces(args, batch, first_candidate, place, within, at);
  const V places = hn::BitCast(d, hn::Iota(di, 0) + hn::Set(di, place));
  const auto tangents = [&](std::int64_t row) HWY_ATTR {
    return promoted(&batch.rows[0] + row * batch_room + place);
  };
  const V none = hn::Set(d, std::numeric_limits<double>::infinity());
  const double least = hn::GetLane(
      hn::MinOfLanes(d, hn::IfThenElse(within, tangents(ScanBatch::min_tangent), none)));
  const double greatest = hn::GetLane(
      hn::MaxOfLanes(d, hn::IfThenElse(within, tangents(ScanBatch::max_tangent), hn::Neg(none))));
  for (std::int64_t k = 0; k < args.planes; ++k) {
    if (args.tan_azimuth[k] < least || args.tan_azimuth[k] > greatest) continue;
    const V sine = hn::Set(d, args.sin_azimuth[k]), cosine = hn::Set(d, args.cos_azimuth[k]);
    const V off_a = off_plane(sine, cosine, a.x, a.y), off_b = off_plane(sine, cosine, b.x, b.y),
            off_c = off_plane(sine, cosine, c.x, c.y);
    const M side_a = hn::Ge(off_a, zero), side_b = hn::Ge(off_b, zero),
            side_c = hn::Ge(off_c, zero);
    const M a_from_b = hn::Xor(side_a, side_b), a_from_c = hn::Xor(side_a, side_c);
    const M crosses = hn::And(hn::Or(a_from_b, a_from_c), within);
    if (hn::AllFalse(d, crosses)) continue;
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
      store_some(d, values, crosses, list + row * ScanBatch::list_room);
    };
    note(0, p.x), note(1, p.y), note(2, q.x), note(3, q.y), note(4, places);
    count += static_cast<std::int64_t>(hn::CountTrue(d, crosses));
  }
}

// A face's claim on a plane's rays: 1 / t = x cos(elevation) + y sin(elevation), within bounds.
struct Claim {
  float x, y, least, greatest;
  std::uint32_t candidate;
  bool on_edge;  // float is not enough for 1 / t
};

// The claim in double, from the face's corners. Hits and runs share this one computation.
HWY_NOINLINE PreciseClaim precise_claim(const ScanArgs& args, std::uint32_t candidate,
                                        std::int64_t plane) {
  const std::int64_t index = args.index[candidate];
  const float* rows =
      args.block_rows + index / block_faces * block_rows * block_faces + index % block_faces;
  float corners[3][3];
  for (std::int64_t k = 0; k < 3; ++k)
    for (std::int64_t i = 0; i < 3; ++i) corners[k][i] = rows[(3 * k + i) * block_faces];
  return precise_claim(args.frame, corners, args.sin_azimuth[plane], args.cos_azimuth[plane]);
}

HWY_INLINE double nearness_on(const ScanArgs& args, const PreciseClaim& face, std::int64_t ray) {
  return nearness_on(face, args.cos_elevation[ray], args.sin_elevation[ray]);
}

// Whether a face is nearer on a ray than another. At equal distance the lowest number wins, then
// the first.
HWY_INLINE bool nearer(const ScanArgs& args, const PreciseClaim& face, std::uint32_t candidate,
                       std::uint32_t than, std::int64_t plane, std::int64_t ray) {
  const double one = nearness_on(args, face, ray);
  const double other = nearness_on(args, precise_claim(args, than, plane), ray);
  if (one != other) return one > other;
  const std::uint32_t i = args.index[candidate], j = args.index[than];
  if (!args.numbers || args.numbers[i] == args.numbers[j]) return i < j;
  return args.numbers[i] < args.numbers[j];
}

// The face claims each of the rays [from, until) of a plane on which it is nearer than all faces
// before. Double decides where float is not enough. It is called rarely and is a separate function,
// so that claim_row keeps its values in registers.
HWY_NOINLINE void claim_carefully(const ScanArgs& args, std::int64_t plane, std::int64_t from,
                                  std::int64_t until, Claim face) {
  const PreciseClaim precise = precise_claim(args, face.candidate, plane);
  float* nearness = args.nearness + plane * args.stride;
  std::uint32_t* nearest = args.nearest + plane * args.stride;
  for (std::int64_t j = from; j < until; ++j) {
    const float plain = face.on_edge ? static_cast<float>(nearness_on(args, precise, j))
                                     : std::fma(face.x, args.cos_elevation_rounded[j],
                                                face.y * args.sin_elevation_rounded[j]);
    const float within = plain > face.least ? plain : face.least;
    const float w = within < face.greatest ? within : face.greatest;
    if (w * surely_nearer > nearness[j] ||
        (w * maybe_nearer > nearness[j] &&
         nearer(args, precise, face.candidate, nearest[j], plane, j))) {
      nearness[j] = w;
      nearest[j] = face.candidate;
    }
  }
}

// The same claim, decided in float until a ray needs double.
HWY_INLINE void claim_row(const ScanArgs& args, std::int64_t plane, std::int64_t from,
                          std::int64_t until, const Claim& face) {
  constexpr F f;
  constexpr hn::RebindToUnsigned<F> u;
  constexpr auto width = static_cast<std::int64_t>(hn::MaxLanes(f));
  float* nearness = args.nearness + plane * args.stride;
  std::uint32_t* nearest = args.nearest + plane * args.stride;
  const auto x = hn::Set(f, face.x), y = hn::Set(f, face.y);
  const auto least = hn::Set(f, face.least), greatest = hn::Set(f, face.greatest);
  const auto candidate = hn::Set(u, face.candidate);
  for (std::int64_t j = from; j < until; j += width) {
    const auto cosine = hn::LoadU(f, args.cos_elevation_rounded + j);
    const auto sine = hn::LoadU(f, args.sin_elevation_rounded + j);
    const auto plain = fma(x, cosine, y * sine);
    // `old` arrives late, because the last face's store wrote it: everything that does not need it
    // is computed first.
    const auto within = hn::FirstN(f, static_cast<std::size_t>(until - j));
    const auto w = hn::IfThenElseZero(within, hn::Min(hn::Max(plain, least), greatest));
    const auto surely = w * hn::Set(f, surely_nearer);
    const auto perhaps = w * hn::Set(f, maybe_nearer);
    const auto old = hn::LoadU(f, nearness + j);
    const auto wins = hn::Gt(surely, old);
    if (HWY_UNLIKELY(!hn::AllFalse(f, hn::AndNot(wins, hn::Gt(perhaps, old)))))
      return claim_carefully(args, plane, j, until, face);
    hn::StoreU(hn::IfThenElse(wins, w, old), f, nearness + j);
    hn::StoreU(hn::IfThenElse(hn::RebindMask(u, wins), candidate, hn::LoadU(u, nearest + j)), u,
               nearest + j);
  }
}

// Claims rays [from, until) except those outside the beam.
HWY_INLINE void claim_rays(const ScanArgs& args, std::int64_t plane, std::int64_t from,
                           std::int64_t until, const Claim& face) {
  const std::int64_t first = args.left_out_from[plane], last = args.left_out_until[plane];
  const auto claim = [&](std::int64_t begin, std::int64_t end) HWY_ATTR {
    if (HWY_UNLIKELY(face.on_edge)) return claim_carefully(args, plane, begin, end, face);
    claim_row(args, plane, begin, end, face);
  };
  if (from < first) claim(from, until < first ? until : first);
  if (until > last) claim(from > last ? from : last, until);
}

// A face that contains the origin meets all rays of a plane at the origin, except rays that lie in
// the face.
HWY_NOINLINE void claim_at_origin(const ScanArgs& args, std::int64_t plane, double order_in_face,
                                  Claim face) {
  face.least = face.greatest = nearest_of_all;
  const double* order = args.order.ascending + 1;
  std::int64_t below = 0;
  while (below < args.elevations && order[below] < order_in_face) ++below;
  std::int64_t above = below;
  while (above < args.elevations && order[above] == order_in_face) ++above;
  claim_rays(args, plane, 0, below, face);
  claim_rays(args, plane, above, args.elevations, face);
}

// The claim of a face of the batch on a plane's rays.
HWY_INLINE Claim claim_of(const ScanArgs& args, const ScanBatch& batch, std::int64_t plane,
                          std::int64_t place, std::int64_t first_candidate) {
  const float* face = &batch.planes[0] + place;
  const float sine = static_cast<float>(args.sin_azimuth[plane]);
  const float cosine = static_cast<float>(args.cos_azimuth[plane]);
  const float least = face[3 * batch_room];
  return {std::fma(face[0], sine, face[batch_room] * cosine),
          face[2 * batch_room],
          std::fabs(least),
          face[4 * batch_room],
          static_cast<std::uint32_t>(first_candidate + place),
          least < 0.0f};
}

// Replaces a plane's list of crossings by a list of ray intervals: the first row holds the first
// ray and, in the upper half, the end; the second row holds the face. Faces without rays are
// dropped.
HWY_INLINE void find_intervals(const ScanArgs& args, ScanBatch& batch, std::int64_t plane,
                               std::int64_t first_candidate) {
  const V zero = hn::Zero(d);
  const auto all = hn::Set(di, args.elevations);
  const std::int64_t count = batch.counts[plane];
  double* const rows = crossings_of(batch, plane);
  constexpr std::int64_t room = ScanBatch::list_room;
  auto least = all, greatest = hn::Zero(di);
  for (std::int64_t row = 0; row < ScanBatch::list_rows; ++row)  // fills the last vector
    hn::StoreU(hn::Set(d, rows[row * room]), d, rows + row * room + count);
  std::int64_t intervals = 0;
  for (std::int64_t first = 0; first < count; first += lanes) {
    const double* at = rows + first;
    const Crossing p{hn::LoadU(d, at), hn::LoadU(d, at + room)};
    const Crossing q{hn::LoadU(d, at + 2 * room), hn::LoadU(d, at + 3 * room)};
    const V places = hn::LoadU(d, at + 4 * room);

    // There are no rays behind the pole. A face that extends there covers all rays above the
    // crossing in front, or all below it.
    const M p_front = hn::Gt(p.x, zero), q_front = hn::Gt(q.x, zero);
    const V p_order = order_of(p_front, p), q_order = order_of(q_front, q);
    hn::Vec<I> p_rays, q_rays;
    find_below(OneOrder{args.order}, p_order, q_order, p_rays, q_rays);
    if (HWY_UNLIKELY(!hn::AllTrue(d, hn::And(p_front, q_front)))) {
      const V turn = p.x * q.y - p.y * q.x;
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

    least = hn::Min(least, hn::IfThenElse(hn::RebindMask(di, some), from, all));
    greatest = hn::Max(greatest, hn::IfThenElseZero(hn::RebindMask(di, some), until));
    if (HWY_UNLIKELY(batch.through_origin)) {
      least = hn::Zero(di), greatest = all;
      const V size =
          hn::Max(hn::Max(hn::Abs(p.x), hn::Abs(p.y)), hn::Max(hn::Abs(q.x), hn::Abs(q.y)));
      const V sees = hn::GatherIndex(d, &batch.sees_origin[0], hn::BitCast(di, places));
      const M at_origin = hn::And(
          hn::Gt(sees, zero), hn::And(hn::Le(fma(p.x, q.x, p.y * q.y), zero), hn::Gt(size, zero)));
      const M take_p = hn::Ne(p.x, zero);
      const V x = hn::IfThenElse(take_p, p.x, q.x), y = hn::IfThenElse(take_p, p.y, q.y);
      const M behind = hn::Lt(x, zero), along_pole = hn::Eq(x, zero);
      const V order =
          order_of(hn::Not(along_pole), {hn::Abs(x), hn::IfThenElse(behind, hn::Neg(y), y)});
      alignas(64) double order_in_face[lanes];
      alignas(64) std::int64_t place[lanes];
      hn::Store(hn::IfThenElse(along_pole, hn::Set(d, 3.0), order), d, order_in_face);
      hn::Store(hn::BitCast(di, places), di, place);
      const unsigned through = bits_of(d, at_origin);
      for (std::int64_t i = 0; i < lanes && first + i < count; ++i)
        if (through >> i & 1)
          claim_at_origin(args, plane, order_in_face[i],
                          claim_of(args, batch, plane, place[i], first_candidate));
      some = hn::AndNot(at_origin, some);
    }
    const V interval = hn::BitCast(d, hn::Or(from, hn::ShiftLeft<32>(until)));
    store_some(d, interval, some, rows + intervals);
    store_some(d, places, some, rows + room + intervals);
    intervals += static_cast<std::int64_t>(hn::CountTrue(d, some));
  }
  batch.counts[plane] = intervals;
  const std::int64_t first = hn::GetLane(hn::MinOfLanes(di, least));
  const std::int64_t end = hn::GetLane(hn::MaxOfLanes(di, greatest));
  if (first < batch.claimed_from[plane]) batch.claimed_from[plane] = first;
  if (end > batch.claimed_until[plane]) batch.claimed_until[plane] = end;
}

// Takes one face of each plane in turn, because when a plane gets its next face, the last stores to
// its row can be read again without waiting.
HWY_INLINE void claim_intervals(const ScanArgs& args, ScanBatch& batch,
                                std::int64_t first_candidate) {
  for (std::int64_t i = 0, left = 1; left > 0; ++i) {
    left = 0;
    for (std::int64_t k = 0; k < args.planes; ++k) {
      if (i >= batch.counts[k]) continue;
      left += batch.counts[k] - i - 1;
      const double* at = crossings_of(batch, k) + i;
      const auto interval = __builtin_bit_cast(std::int64_t, at[0]);
      const auto place = __builtin_bit_cast(std::int64_t, at[ScanBatch::list_room]);
      claim_rays(args, k, interval & 0xffffffff, interval >> 32,
                 claim_of(args, batch, k, place, first_candidate));
    }
  }
}

}  // namespace

// A plane may meet a block that is within range, extends to both sides of the plane and is not all
// behind the pole, unless all of the block is at elevations that the plane leaves out.
void find_blocks(ScanArgs& args) {
  const Frame frame = laid(args.frame);
  const V range2 = hn::Set(d, args.range_m * args.range_m);
  const V wider = hn::Set(d, 1.0 + 1e-12), rounding = hn::Set(d, 1e-14), zero = hn::Zero(d);
  double widest = 0.0, least_cosine = 1.0;
  for (std::int64_t k = 0; k < args.planes; ++k) {
    const double sine = std::fabs(args.sin_azimuth[k]), cosine = args.cos_azimuth[k];
    widest = sine > widest ? sine : widest;
    least_cosine = cosine < least_cosine ? cosine : least_cosine;
  }
  std::int64_t count = 0;
  for (std::int64_t block = 0; block < args.blocks; block += lanes) {
    const float* box = args.boxes + block;
    const std::int64_t row = args.boxes_in_row;
    const V3 middle{promoted(box), promoted(box + row), promoted(box + 2 * row)};
    const V3 half{promoted(box + 3 * row), promoted(box + 4 * row), promoted(box + 5 * row)};
    const V3 from = middle - frame.origin;
    const V3 away{hn::Abs(from.x), hn::Abs(from.y), hn::Abs(from.z)};
    const V3 gap = away - half;
    const V3 least{hn::Max(gap.x, zero), hn::Max(gap.y, zero), hn::Max(gap.z, zero)};
    const M in_range = hn::Le(dot(least, least), range2 * wider);
    if (hn::AllFalse(d, in_range)) continue;

    const auto reach = [&](const V3& axis) HWY_ATTR {
      return dot({hn::Abs(axis.x), hn::Abs(axis.y), hn::Abs(axis.z)}, half);
    };
    const V slack = rounding * (away.x + away.y + away.z + (half.x + half.y + half.z));
    const V x = dot(frame.array, from), y = dot(frame.middle, from), z = dot(frame.pole, from);
    const V reach_x = fma(reach(frame.array), wider, slack);
    const V reach_y = fma(reach(frame.middle), wider, slack);
    const V reach_z = fma(reach(frame.pole), wider, slack);
    const V low = z - reach_z, high = z + reach_z;
    // A bound on how far along any plane a block reaches, if all of it is where y is negative.
    const V farthest =
        fma(hn::Set(d, least_cosine), y + reach_y, hn::Set(d, widest) * (hn::Abs(x) + reach_x));
    const M behind = hn::And(hn::Lt(y + reach_y, zero), hn::Lt(farthest, zero));
    if (hn::AllTrue(d, hn::Or(behind, hn::Not(in_range)))) continue;
    const V everywhere = hn::Set(d, std::numeric_limits<double>::infinity());
    V first_plane = hn::Set(d, static_cast<double>(args.planes)), last_plane = hn::Set(d, -1.0);
    V lowest = everywhere, highest = hn::Neg(everywhere);
    for (std::int64_t k = 0; k < args.planes; ++k) {
      const V sine = hn::Set(d, args.sin_azimuth[k]), cosine = hn::Set(d, args.cos_azimuth[k]);
      const V off = hn::Abs(off_plane(sine, cosine, x, y));
      const V off_reach = fma(hn::Abs(cosine), reach_x, hn::Abs(sine) * reach_y);
      const V along = along_plane(sine, cosine, x, y);
      const V along_reach = fma(hn::Abs(cosine), reach_y, hn::Abs(sine) * reach_x);
      const V near = along - along_reach, far = along + along_reach;
      M meets = hn::And(in_range, hn::And(hn::Le(off, off_reach), hn::Ge(far, zero)));
      const std::int64_t left_out = args.left_out_from[k], after = args.left_out_until[k];
      if (left_out < after) {
        // Whether all of the block is above the last ray before these, or below the next one.
        const auto apart = [&](std::int64_t ray, V height, double side) HWY_ATTR {
          const V sine_e = hn::Set(d, args.sin_elevation[ray]);
          const V cosine_e = hn::Set(d, args.cos_elevation[ray]);
          const V of_near = height * cosine_e - near * sine_e;
          const V of_far = height * cosine_e - far * sine_e;
          const V least = hn::Min(hn::Set(d, side) * of_near, hn::Set(d, side) * of_far);
          return hn::Gt(least, slack);
        };
        M outside = hn::Gt(near, zero);
        if (left_out > 0) outside = hn::And(outside, apart(left_out - 1, low, 1.0));
        if (after < args.elevations) outside = hn::And(outside, apart(after, high, -1.0));
        meets = hn::AndNot(outside, meets);
      }
      const V number = hn::Set(d, static_cast<double>(k));
      first_plane = hn::IfThenElse(meets, hn::Min(first_plane, number), first_plane);
      last_plane = hn::IfThenElse(meets, number, last_plane);
      const bool in_front = args.cos_azimuth[k] > 0.0;  // else its tangent is on the other side
      const V tangent = hn::Set(d, double{args.tan_azimuth[k]});
      lowest =
          hn::IfThenElse(meets, hn::Min(lowest, in_front ? tangent : hn::Neg(everywhere)), lowest);
      highest = hn::IfThenElse(meets, hn::Max(highest, in_front ? tangent : everywhere), highest);
    }
    alignas(64) double first[lanes], last[lanes];
    alignas(64) float tangents[2][lanes];
    hn::Store(first_plane, d, first);
    hn::Store(last_plane, d, last);
    hn::Store(hn::DemoteTo(df, lowest), df, tangents[0]);
    hn::Store(hn::DemoteTo(df, highest), df, tangents[1]);
    for (std::int64_t i = 0; i < lanes && block + i < args.blocks; ++i) {
      if (last[i] < 0.0) continue;
      args.blocks_met[count++] = {
          static_cast<std::uint32_t>(block + i), static_cast<std::uint32_t>(first[i]),
          static_cast<std::uint32_t>(last[i]), tangents[0][i], tangents[1][i]};
    }
  }
  args.blocks_met_count = count;
}

void scan_faces(const ScanArgs& args, ScanBatch& batch) {
  const Frame frame = laid(args.frame);
  for (std::int64_t k = 0; k < args.planes; ++k)
    batch.claimed_from[k] = args.elevations, batch.claimed_until[k] = 0;
  std::int64_t candidates = 0;
  for (std::int64_t block = 0; block < args.blocks_met_count;) {
    batch.count = 0;
    for (; block < args.blocks_met_count && batch.count <= batch_faces - block_faces; ++block)
      add_block(args, batch, args.blocks_met[block], args.index + candidates);
    for (std::int64_t k = 0; k < args.planes; ++k) batch.counts[k] = 0;
    batch.through_origin = false;
    for (std::int64_t place = 0; place < batch.count; place += lanes)
      cross_faces(args, frame, batch, candidates, place);
    for (std::int64_t k = 0; k < args.planes; ++k)
      if (batch.counts[k] > 0) find_intervals(args, batch, k, candidates);
    claim_intervals(args, batch, candidates);
    candidates += batch.count;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(find_blocks);
HWY_EXPORT(scan_faces);

void find_blocks(ScanArgs& args) { HWY_DYNAMIC_DISPATCH(find_blocks)(args); }
void scan_faces(const ScanArgs& args, ScanBatch& batch) {
  HWY_DYNAMIC_DISPATCH(scan_faces)(args, batch);
}

}  // namespace ensonify::engine
#endif
