// Compiled once per Highway target (vector_targets.h).

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/trace/refraction/straighten_kernel.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <ensonify/engine/simd/vec3-inl.h>
#include <ensonify/engine/trace/refraction/straighten_kernel.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

HWY_INLINE V number(double value) { return hn::Set(d, value); }

// A value of bicubics and its slope over x.
struct Value {
  V at, slope;
};
HWY_INLINE Value value_of(const double* cubics, V x, V y) {
  V in_x[4];
  for (int b = 0; b < 4; ++b)
    in_x[b] = number(cubics[b]) + y * (number(cubics[4 + b]) +
                                       y * (number(cubics[8 + b]) + y * number(cubics[12 + b])));
  return {in_x[0] + x * (in_x[1] + x * (in_x[2] + x * in_x[3])),
          in_x[1] + x * (number(2.0) * in_x[2] + x * number(3.0) * in_x[3])};
}

}  // namespace

// Uses no fused operations, because Straightening::move() of one point uses none.
void straighten_points(const PointsOfPatch& points, const MovedPointRows& to) {
  const V one = number(1.0), zero = hn::Zero(d);
  for (std::size_t i = 0; i < points.count; i += static_cast<std::size_t>(lanes)) {
    const auto take = [&](const float* from)
                          HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(df, from + i)); };
    const V out_x = take(points.x_m) - number(points.source_m[0]);
    const V out_y = number(points.y_m - points.source_m[1]);
    const V z = take(points.z_m);
    const V range = hn::Sqrt(out_x * out_x + out_y * out_y);
    const V depth = zero - z;
    const V below = depth - number(-points.source_m[2]);

    const V over = range + number(points.slope_scale) * below;
    const V x = number(points.columns) * range / over - number(points.column);
    const V down_m = depth - number(points.top_m), y = down_m * number(points.per_m);
    const V straight_cotangent = range / below;
    const V straight = hn::Sqrt(range * range + below * below);
    const Value ratio = value_of(points.straight_over_launch, x, y);
    const V x_per_m = number(points.columns * points.slope_scale) * below / (over * over);
    const V cotangent = straight_cotangent / ratio.at;
    const V time = straight * value_of(points.time_s_per_m, x, y).at;
    const V range_per_cotangent =
        below * ratio.at * ratio.at / (ratio.at - range * ratio.slope * x_per_m);
    const V speed = number(points.top_mps) + number(points.gradient_per_s) * down_m;

    const V sine = one / hn::Sqrt(one + cotangent * cotangent);
    const V t = number(points.reference_mps) * time;
    const M is_out = hn::Gt(range, zero);
    const V level = hn::IfThenElseZero(is_out, t * cotangent * sine / range);
    const V moved_x = level * out_x, moved_y = level * out_y, moved_z = (zero - t) * sine;

    const V cosine = cotangent * sine;
    const V along = cosine * speed / number(points.source_mps);
    const V down = hn::Sqrt(one - along * along);
    const V spread = range_per_cotangent / (sine * sine) * down;
    const V forwards = number(points.reference_mps) / speed, across = t / spread;
    const V out_by_out = forwards * cosine * along + across * sine * down;
    const V out_by_down = forwards * cosine * down - across * sine * along;
    const V down_by_out = forwards * sine * along - across * cosine * down;
    const V down_by_down = forwards * sine * down + across * cosine * along;
    const M aside = hn::Gt(cosine, number(1e-6));
    const V sideways = hn::IfThenElse(aside, level, t / range_per_cotangent);
    const V east = hn::IfThenElse(aside, out_x / range, one);
    const V north = hn::IfThenElseZero(aside, out_y / range);
    const V aslant = (out_by_out - sideways) * east * north;
    const V jacobian[9] = {out_by_out * east * east + sideways * north * north,
                           aslant,
                           (zero - down_by_out) * east,
                           aslant,
                           out_by_out * north * north + sideways * east * east,
                           (zero - down_by_out) * north,
                           (zero - out_by_down) * east,
                           (zero - out_by_down) * north,
                           down_by_down};

    float position[3][hn::MaxLanes(df)];
    hn::StoreU(hn::DemoteTo(df, moved_x), df, position[0]);
    hn::StoreU(hn::DemoteTo(df, moved_y), df, position[1]);
    hn::StoreU(hn::DemoteTo(df, moved_z), df, position[2]);
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(lanes) && i + lane < points.count;
         ++lane) {
      float* const place = to.positions + 4 * (i + lane);
      for (std::size_t k = 0; k < 3; ++k) place[k] = position[k][lane];
      place[3] = 0.0f;
    }
    for (std::size_t k = 0; k < 9; ++k)
      hn::StoreU(hn::DemoteTo(df, jacobian[k]), df, to.jacobians + k * to.jacobian_room + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(straighten_points);

void straighten_points(const PointsOfPatch& points, const MovedPointRows& to) {
  HWY_DYNAMIC_DISPATCH(straighten_points)(points, to);
}

}  // namespace ensonify::engine
#endif
