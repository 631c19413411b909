// Compiled once for each of Highway's targets; see steered_kernel.h.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ensonify/engine/sonar/echo/steered_kernel.cpp"
#include <ensonify/engine/simd/vector_targets.h>

#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <ensonify/engine/sonar/echo/steered_kernel.h>

HWY_BEFORE_NAMESPACE();
namespace ensonify::engine {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using F = hn::ScalableTag<float>;
constexpr F f;

/// Calls part(lanes tag, bin) for whole registers, then for single bins.
template <class Part>
HWY_INLINE void over_bins(std::size_t bins, Part&& part) {
  std::size_t n = 0;
  for (; n + hn::Lanes(f) <= bins; n += hn::Lanes(f)) part(f, n);
  for (; n < bins; ++n) part(hn::CappedTag<float, 1>(), n);
}

}  // namespace

void add_plane(const PlaneBins& plane, std::uint32_t number, float power, std::size_t bins,
               const BeamBins& beam) {
  over_bins(bins, [&](auto tag, std::size_t n) HWY_ATTR {
    const hn::RebindToUnsigned<decltype(tag)> whole;
    const auto factor = hn::Set(tag, power);
    const auto its_number = hn::Set(whole, number);
    const auto add = [&](const float* from, float* to) HWY_ATTR {
      const auto here = hn::Mul(factor, hn::LoadU(tag, from + n));
      hn::StoreU(hn::Add(hn::LoadU(tag, to + n), here), tag, to + n);
      return here;
    };
    const auto take = [&](auto where, auto value, std::uint32_t* to) HWY_ATTR {
      const auto mask = hn::RebindMask(whole, where);
      hn::StoreU(hn::IfThenElse(mask, value, hn::LoadU(whole, to + n)), whole, to + n);
    };
    add(plane.lit, beam.lit);
    const auto here = add(plane.energy, beam.energy);
    const auto most = hn::LoadU(tag, beam.most + n);
    const auto stronger = hn::Gt(here, most);
    hn::StoreU(hn::Max(here, most), tag, beam.most + n);
    take(stronger, its_number, beam.plane);
    take(stronger, hn::LoadU(whole, plane.label + n), beam.label);
    const auto dark = add(plane.shadowed, beam.shadowed);
    const auto most_dark = hn::LoadU(tag, beam.most_shadowed + n);
    hn::StoreU(hn::Max(dark, most_dark), tag, beam.most_shadowed + n);
    take(hn::Gt(dark, most_dark), its_number, beam.shadowing_plane);
  });
}

void add_same_label(const PlaneBins& plane, float power, std::size_t bins, const BeamBins& beam) {
  over_bins(bins, [&](auto tag, std::size_t n) HWY_ATTR {
    const hn::RebindToUnsigned<decltype(tag)> whole;
    const auto same = hn::Eq(hn::LoadU(whole, plane.label + n), hn::LoadU(whole, beam.label + n));
    const auto here = hn::IfThenElseZero(
        hn::RebindMask(tag, same), hn::Mul(hn::Set(tag, power), hn::LoadU(tag, plane.energy + n)));
    hn::StoreU(hn::Add(hn::LoadU(tag, beam.of_label + n), here), tag, beam.of_label + n);
  });
}

void add_field(const FieldSums& of, std::size_t bins) {
  over_bins(bins, [&](auto tag, std::size_t n) HWY_ATTR {
    const auto re = hn::Set(tag, of.re), im = hn::Set(tag, of.im);
    const auto a = hn::LoadU(tag, of.plane_re + n), b = hn::LoadU(tag, of.plane_im + n);
    const auto sum_re = hn::Sub(hn::Mul(re, a), hn::Mul(im, b));
    const auto sum_im = hn::Add(hn::Mul(re, b), hn::Mul(im, a));
    hn::StoreU(hn::Add(hn::LoadU(tag, of.sum_re + n), sum_re), tag, of.sum_re + n);
    hn::StoreU(hn::Add(hn::LoadU(tag, of.sum_im + n), sum_im), tag, of.sum_im + n);
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(add_plane);
HWY_EXPORT(add_same_label);
HWY_EXPORT(add_field);

void add_plane(const PlaneBins& plane, std::uint32_t number, float power, std::size_t bins,
               const BeamBins& beam) {
  HWY_DYNAMIC_DISPATCH(add_plane)(plane, number, power, bins, beam);
}
void add_same_label(const PlaneBins& plane, float power, std::size_t bins, const BeamBins& beam) {
  HWY_DYNAMIC_DISPATCH(add_same_label)(plane, power, bins, beam);
}
void add_field(const FieldSums& sums, std::size_t bins) {
  HWY_DYNAMIC_DISPATCH(add_field)(sums, bins);
}

}  // namespace ensonify::engine
#endif
