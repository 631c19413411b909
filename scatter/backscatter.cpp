#include <ensonify/scatter/backscatter.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/scatter/composite_roughness.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/kirchhoff.h>
#include <ensonify/scatter/large_roughness.h>
#include <ensonify/scatter/sediment_volume.h>
#include <ensonify/scatter/small_slope.h>

namespace ensonify::scatter {
namespace {

using std::numbers::pi;

constexpr double smallest_grazing_rad = 0.001 * pi / 180.0;

/// TR 9407 eq. 57, with IV.C.4's limits.
double interpolation_weight(double x) { return 1.0 / (1.0 + std::exp(std::clamp(x, -40.0, 40.0))); }

}  // namespace

Lambert::Lambert(double mu_db) : mu_(from_db(mu_db)) {
  if (!(mu_ <= std::numbers::inv_pi))
    throw std::invalid_argument(
        "Lambert: mu_db is above -4.97 dB: more than the arriving energy would be scattered");
}

double Lambert::cross_section(double grazing_rad) const {
  const double s = std::sin(grazing_rad);
  return mu_ * s * s;
}

BottomModel bottom_model(std::string_view name) {
  if (name == "tr9407") return BottomModel::tr9407;
  if (name == "small-slope") return BottomModel::small_slope;
  if (name == "lambert") return BottomModel::lambert;
  throw std::invalid_argument(
      fmt::format("bottom model '{}' is not known, expected tr9407, small-slope or lambert", name));
}

double gentle_relief_weight(double slope) {
  return interpolation_weight((std::atan(slope) * 180.0 / pi - 7.0) / 0.5);
}

Bottom::Bottom(const Sediment& sediment, double frequency_hz, double sound_speed_mps,
               BottomModel model, double resolved_slope_fraction)
    : sediment_(sediment),
      model_(model),
      k_per_cm_(relief_wavenumber_per_cm(sediment, frequency_hz, sound_speed_mps)),
      slope_(rms_slope(sediment, k_per_cm_)),
      unresolved_slope_(slope_ * std::sqrt(1.0 - resolved_slope_fraction)),
      offset_(from_db(sediment.strength_offset_db)) {
  check(sediment);
  if (!(resolved_slope_fraction >= 0.0 && resolved_slope_fraction <= 1.0))
    throw std::invalid_argument(
        fmt::format("the resolved slope fraction is {}, expected 0 to 1", resolved_slope_fraction));
  if (model == BottomModel::small_slope)
    small_slope_.emplace(sediment, frequency_hz, sound_speed_mps);
}

BottomTerms Bottom::tr9407(double grazing_rad) const {
  BottomTerms terms;
  terms.kirchhoff = kirchhoff(sediment_, k_per_cm_, grazing_rad);
  terms.composite = composite_roughness(sediment_, k_per_cm_, grazing_rad, unresolved_slope_);
  terms.large_roughness = large_roughness(sediment_, grazing_rad, slope_);
  const double f_x = interpolation_weight(
      (std::cos(grazing_rad) - kirchhoff_end_cosine(sediment_, k_per_cm_)) / 0.0125);
  const double f_y = gentle_relief_weight(slope_);
  const double gentle = f_x * terms.kirchhoff + (1.0 - f_x) * terms.composite;  // eq. 58
  terms.roughness = f_y * gentle + (1.0 - f_y) * terms.large_roughness;         // eq. 62
  return terms;
}

BottomTerms Bottom::terms(double grazing_rad) const {
  if (model_ == BottomModel::lambert) return {.roughness = Lambert().cross_section(grazing_rad)};
  const double grazing = std::max(grazing_rad, smallest_grazing_rad);
  BottomTerms terms;
  if (small_slope_)
    terms.roughness = small_slope_->cross_section(grazing);
  else
    terms = tr9407(grazing);
  terms.volume = sediment_volume(sediment_, grazing, unresolved_slope_);
  return terms;
}

double Bottom::cross_section(double grazing_rad) const {
  const BottomTerms sum = terms(grazing_rad);
  return offset_ * (sum.roughness + sum.volume);
}

BackscatterTable::BackscatterTable(const Backscatter& model) {
  const auto quotient = [&](double grazing_rad) {
    return static_cast<float>(model.cross_section(grazing_rad) / std::sin(grazing_rad));
  };
  constexpr std::uint64_t last = std::bit_cast<std::uint64_t>(highest);
  for (std::uint64_t bits = lowest_bits; bits < last; bits += std::uint64_t{1} << cell_bits)
    quotient_.push_back(quotient(std::atan(std::sqrt(std::bit_cast<double>(bits)))));
  quotient_.resize(quotient_.size() + 2, quotient(pi / 2.0));  // the last cell is for x = highest
}

}  // namespace ensonify::scatter
