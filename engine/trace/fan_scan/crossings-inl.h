// Where faces' edges cross a plane of a fan, and which rays of the plane are below. Kernels include
// it; they are compiled once per Highway target. It must not use inline functions of the rest of
// the program.

#if defined(ENSONIFY_CROSSINGS) == defined(HWY_TARGET_TOGGLE)
#ifdef ENSONIFY_CROSSINGS
#undef ENSONIFY_CROSSINGS
#else
#define ENSONIFY_CROSSINGS
#endif

#include <hwy/highway.h>

#include <ensonify/engine/simd/gather-inl.h>
#include <ensonify/engine/simd/vec3-inl.h>
#include <ensonify/engine/trace/fan_scan/elevation_order.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

// How far a point is from a plane of the fan. All callers share this one computation, so that they
// agree on which side of the plane a point is.
HWY_INLINE V off_plane(V sin_azimuth, V cos_azimuth, V x, V y) {
  const V back = sin_azimuth * y;
#if HWY_TARGET == HWY_SCALAR
  return fma(cos_azimuth, x, hn::Neg(back));
#else
  return hn::MulSub(cos_azimuth, x, back);
#endif
}
HWY_INLINE V along_plane(V sin_azimuth, V cos_azimuth, V x, V y) {
  return fma(cos_azimuth, y, sin_azimuth * x);
}

// Where an edge crosses a plane: coordinates along the plane and along the pole, times a positive
// number. It does not depend on the order of the edge's ends.
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
  return {weight_p * p.x + weight_q * q.x, weight_p * p.y + weight_q * q.y};
}

// The q (fan_tables.h) of a crossing in front of the pole; 0 for other crossings.
HWY_INLINE V order_of(M in_front, const Crossing& at) {
  const V across = hn::IfThenElse(in_front, at.x + hn::Abs(at.y), hn::Set(d, 1.0));
  return hn::IfThenElseZero(in_front, at.y) / across;
}

// How many of the plane's rays are below a crossing. It depends on the crossing alone, so faces
// that share a crossing get the same number. The search starts from a guess. Then a comparison with
// one ray decides whether the guess or one more is right, unless the guess is marked as possibly
// far off.
struct Guess {
  hn::Vec<I> below;
  M far_off;
};
using U = hn::RebindToUnsigned<D>;
constexpr U du;  // NOLINT(misc-definitions-in-headers): each target has its own
/// The order of one fan's rays in every lane.
struct OneOrder {
  const ElevationOrder& rays;

  HWY_INLINE V first_q() const { return hn::Set(d, rays.first_q); }
  HWY_INLINE V steps_per_q() const { return hn::Set(d, rays.steps_per_q); }
  HWY_INLINE V last_step() const { return hn::Set(d, rays.steps - 1.0); }
  HWY_INLINE hn::Vec<U> line(hn::Vec<I> step) const { return gather(du, rays.lines, step); }
  HWY_INLINE V before(hn::Vec<I> ray) const { return gather(d, rays.ascending, ray); }
  HWY_INLINE V at(hn::Vec<I> ray) const { return gather(d, rays.ascending + 1, ray); }
};
template <class Order>
HWY_INLINE Guess guess_below(const Order& rays, V order) {
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
  const V stepped = hn::Max((order - rays.first_q()) * rays.steps_per_q(), zero);
  const auto step = hn::ConvertTo(di, hn::Min(stepped, rays.last_step()));
  const V fraction = hn::Min(stepped - hn::ConvertTo(d, step), one);
  constexpr hn::RebindToUnsigned<HalfF> half;
  const auto line = rays.line(step);
  const auto number = [&](hn::Vec<U> bits) HWY_ATTR {
    return hn::PromoteTo(d, hn::BitCast(df, hn::TruncateTo(half, bits)));
  };
  const V below = number(line), rise = number(hn::ShiftRight<32>(line));
  return {hn::ConvertTo(di, fma(fraction, rise, hn::Abs(below))), hn::Lt(below, zero)};
}
template <class Order>
HWY_INLINE void find_below(const Order& rays, V p_order, V q_order, hn::Vec<I>& p, hn::Vec<I>& q) {
  const Guess p_guess = guess_below(rays, p_order), q_guess = guess_below(rays, q_order);
  p = p_guess.below, q = q_guess.below;
  // A mask's true lanes are -1 as integers.
  const auto number = [](M mask) HWY_ATTR { return hn::BitCast(di, hn::VecFromMask(d, mask)); };
  if (HWY_LIKELY(hn::AllFalse(d, hn::Or(p_guess.far_off, q_guess.far_off)))) {
    p = p - number(hn::Lt(rays.at(p), p_order));
    q = q - number(hn::Lt(rays.at(q), q_order));
    return;
  }
  for (;;) {
    const M p_fewer = hn::Ge(rays.before(p), p_order);
    const M q_fewer = hn::Ge(rays.before(q), q_order);
    const M p_more = hn::Lt(rays.at(p), p_order);
    const M q_more = hn::Lt(rays.at(q), q_order);
    if (hn::AllFalse(d, hn::Or(hn::Or(p_fewer, p_more), hn::Or(q_fewer, q_more)))) return;
    p = p + (number(p_fewer) - number(p_more));
    q = q + (number(q_fewer) - number(q_more));
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#endif
