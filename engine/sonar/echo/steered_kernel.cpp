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
using F = hn::CappedTag<float, steered_block>;
using I = hn::RebindToSigned<F>;
using U = hn::RebindToUnsigned<F>;
constexpr F f;
constexpr I whole;
constexpr U number;
using Floats = hn::Vec<F>;

struct Field {
  Floats re, im;
};

/// A beam's field in the lanes of a register, for one plane after the other.
class FieldTable {
 public:
  HWY_INLINE FieldTable(const BeamFields& fields, std::size_t bin)
      : values_(fields.values),
        first_(hn::LoadU(whole, fields.first + bin)),
        columns_(hn::LoadU(f, fields.columns + bin)),
        axis_(hn::Set(f, fields.axis)),
        per_sine_(hn::Set(f, fields.columns_per_sine)),
        is_real_(fields.is_real) {}

  /// The field from the directions with these sines; false if it is 0 in all lanes.
  HWY_INLINE bool at(Floats sine, Field& field) const {
    const Floats place = hn::Mul(hn::Abs(hn::Sub(sine, axis_)), per_sine_);
    const auto received = hn::Lt(place, columns_);
    if (hn::AllFalse(f, received)) return false;
    const auto column = hn::ConvertTo(whole, hn::IfThenElseZero(received, place));
    const auto value = hn::ShiftLeft<1>(hn::Add(first_, column));
    const Floats share = hn::Sub(place, hn::ConvertTo(f, column));
    const auto interpolated = [&](int part) HWY_ATTR {
      const Floats low = hn::GatherIndex(f, values_ + part, value),
                   high = hn::GatherIndex(f, values_ + 2 + part, value);
      return hn::IfThenElseZero(received, hn::Add(low, hn::Mul(share, hn::Sub(high, low))));
    };
    field = {interpolated(0), is_real_ ? hn::Zero(f) : interpolated(1)};
    return true;
  }

 private:
  const float* values_;
  hn::Vec<I> first_;
  Floats columns_, axis_, per_sine_;
  bool is_real_;
};

template <class Part>
HWY_INLINE void over_block(std::size_t bin, Part&& part) {
  for (std::size_t n = 0; n < steered_block; n += hn::Lanes(f)) part(bin + n);
}

}  // namespace

void receive_planes(const PlaneBlock& block, const PlaneBins& planes, const BeamFields& fields,
                    float* powers, const BeamBins& beam) {
  over_block(block.bin, [&](std::size_t bin) HWY_ATTR {
    const FieldTable table(fields, bin);
    Floats energy = hn::Zero(f), lit = energy, shadowed = energy, most = energy, most_dark = energy,
           of_label = energy;
    auto label = hn::Zero(number), strongest = label, darkest = label;
    for (std::size_t plane = block.first; plane < block.last; ++plane) {
      const std::size_t at = plane * block.stride + bin;
      float* its_powers = powers + (plane - block.first) * steered_block;
      Field field;
      if (!table.at(hn::LoadU(f, block.sine + at), field)) {
        hn::StoreU(hn::Zero(f), f, its_powers);
        continue;
      }
      const Floats power = hn::Add(hn::Mul(field.re, field.re), hn::Mul(field.im, field.im));
      hn::StoreU(power, f, its_powers);
      const auto its_number = hn::Set(number, static_cast<std::uint32_t>(plane));
      const Floats here = hn::Mul(power, hn::LoadU(f, planes.energy + at));
      energy = hn::Add(energy, here);
      const auto stronger = hn::RebindMask(number, hn::Gt(here, most));
      most = hn::Max(here, most);
      strongest = hn::IfThenElse(stronger, its_number, strongest);
      label = hn::IfThenElse(stronger, hn::LoadU(number, planes.label + at), label);
      lit = hn::Add(lit, hn::Mul(power, hn::LoadU(f, planes.lit + at)));
      const Floats dark = hn::Mul(power, hn::LoadU(f, planes.shadowed + at));
      shadowed = hn::Add(shadowed, dark);
      darkest =
          hn::IfThenElse(hn::RebindMask(number, hn::Gt(dark, most_dark)), its_number, darkest);
      most_dark = hn::Max(dark, most_dark);
    }
    for (std::size_t plane = block.first; plane < block.last; ++plane) {
      const std::size_t at = plane * block.stride + bin;
      const auto same = hn::Eq(hn::LoadU(number, planes.label + at), label);
      const Floats here = hn::Mul(hn::LoadU(f, powers + (plane - block.first) * steered_block),
                                  hn::LoadU(f, planes.labelled + at));
      of_label = hn::Add(of_label, hn::IfThenElseZero(hn::RebindMask(f, same), here));
    }
    hn::StoreU(energy, f, beam.energy + bin);
    hn::StoreU(lit, f, beam.lit + bin);
    hn::StoreU(shadowed, f, beam.shadowed + bin);
    hn::StoreU(of_label, f, beam.of_label + bin);
    hn::StoreU(most, f, beam.most + bin);
    hn::StoreU(strongest, number, beam.plane + bin);
    hn::StoreU(darkest, number, beam.shadowing_plane + bin);
  });
}

void receive_fields(const PlaneBlock& block, const BeamFields& fields, const FieldSums& sums) {
  over_block(block.bin, [&](std::size_t bin) HWY_ATTR {
    const FieldTable table(fields, bin);
    Floats re = hn::Zero(f), im = re;
    for (std::size_t plane = block.first; plane < block.last; ++plane) {
      const std::size_t at = plane * block.stride + bin;
      Field field;
      if (!table.at(hn::LoadU(f, block.sine + at), field)) continue;
      const Floats a = hn::LoadU(f, sums.plane_re + at), b = hn::LoadU(f, sums.plane_im + at);
      re = hn::Add(re, hn::Sub(hn::Mul(field.re, a), hn::Mul(field.im, b)));
      im = hn::Add(im, hn::Add(hn::Mul(field.re, b), hn::Mul(field.im, a)));
    }
    hn::StoreU(re, f, sums.sum_re + bin);
    hn::StoreU(im, f, sums.sum_im + bin);
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace ensonify::engine
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ensonify::engine {

HWY_EXPORT(receive_planes);
HWY_EXPORT(receive_fields);

void receive_planes(const PlaneBlock& block, const PlaneBins& planes, const BeamFields& fields,
                    float* powers, const BeamBins& beam) {
  HWY_DYNAMIC_DISPATCH(receive_planes)(block, planes, fields, powers, beam);
}
void receive_fields(const PlaneBlock& block, const BeamFields& fields, const FieldSums& sums) {
  HWY_DYNAMIC_DISPATCH(receive_fields)(block, fields, sums);
}

}  // namespace ensonify::engine
#endif
