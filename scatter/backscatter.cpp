#include <ensonify/scatter/backscatter.h>

#include <array>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/composite_roughness.h>
#include <ensonify/scatter/decibel.h>
#include <ensonify/scatter/energy_bound.h>
#include <ensonify/scatter/kind_named.h>
#include <ensonify/scatter/kirchhoff.h>
#include <ensonify/scatter/small_slope.h>
#include <ensonify/scatter/solid_target.h>

namespace ensonify::scatter {
namespace {

using std::numbers::pi;

constexpr double smallest_grazing_rad = 0.001 * degree;

/// TR 9407 eq. 57, with the limits of section IV.C.4.
double interpolation_weight(double x) { return 1.0 / (1.0 + std::exp(std::clamp(x, -40.0, 40.0))); }

/// APL-UW TR 9407 (1994), section IV.
BottomTerms tr9407(const BottomConditions& bed, double grazing_rad) {
  const double grazing = std::max(grazing_rad, smallest_grazing_rad);
  const Sediment& sediment = bed.sediment;
  BottomTerms terms;
  terms.kirchhoff = kirchhoff(sediment, bed.k_per_cm, grazing);
  terms.composite = composite_roughness(sediment, bed.k_per_cm, grazing, bed.unresolved_slope);
  terms.large_roughness = large_roughness(sediment, grazing, bed.slope);
  terms.volume = sediment_volume(sediment, grazing, bed.unresolved_slope);
  // Above its range of frequencies, the large-roughness form grows until more energy returns than
  // arrives: for coarse sand from 400 kHz on, below 10 degrees. So it is limited here. Gravel and
  // rock need no limit, because their form is that of 100 kHz.
  if (!gravel_or_rock(sediment) &&
      expected_spread_db(sediment, bed.frequency_hz) > ordinary_spread_db)
    terms.large_roughness =
        std::clamp(diffuse_bound(grazing) - terms.volume, 0.0, terms.large_roughness);
  const double f_x = interpolation_weight(
      (std::cos(grazing) - kirchhoff_end_cosine(sediment, bed.k_per_cm)) / 0.0125);
  const double f_y = gentle_relief_weight(bed.slope);
  const double gentle = f_x * terms.kirchhoff + (1.0 - f_x) * terms.composite;  // eq. 58
  terms.roughness = f_y * gentle + (1.0 - f_y) * terms.large_roughness;         // eq. 62
  return terms;
}

/// Rock: Lambert's law with the measured strength. Near vertical nothing was measured, but rock
/// reflects more than Lambert's law gives. So the lobe of the solid `stone` is added; it adds less
/// than 0.1 dB up to 45 degrees.
SolidTarget measured_rock(double mu_db) {
  Solid rock = solid_named("stone");
  rock.diffuse_db = mu_db;
  return SolidTarget(rock);
}

BottomModel make_tr9407(const BottomConditions& bed) {
  if (!bed.sediment.lambert_mu_db) return std::bind_front(tr9407, bed);
  return [rock = measured_rock(*bed.sediment.lambert_mu_db)](double grazing_rad) {
    return BottomTerms{.roughness = rock.cross_section(grazing_rad)};
  };
}

/// The small-slope approximation for the roughness, and TR 9407's volume.
BottomModel make_small_slope(const BottomConditions& bed) {
  return [bed, roughness = SmallSlope(bed.sediment, bed.frequency_hz, bed.sound_speed_mps)](
             double grazing_rad) {
    const double grazing = std::max(grazing_rad, smallest_grazing_rad);
    return BottomTerms{.roughness = roughness.cross_section(grazing),
                       .volume = sediment_volume(bed.sediment, grazing, bed.unresolved_slope)};
  };
}

/// Lambert's law with Mackenzie's strength, for every sediment.
BottomModel make_lambert(const BottomConditions&) {
  return [law = Lambert()](double grazing_rad) {
    return BottomTerms{.roughness = law.cross_section(grazing_rad)};
  };
}

constexpr std::array models{
    BottomModelKind{.name = "tr9407",
                    .help = "the APL-UW TR 9407 model for sediments, measured strengths for rock",
                    .make = &make_tr9407},
    BottomModelKind{.name = "small-slope",
                    .help = "the small-slope approximation for the roughness of sediments",
                    .make = &make_small_slope},
    BottomModelKind{.name = "lambert",
                    .help = "Lambert's law, whatever the sediment",
                    .make = &make_lambert,
                    .by_sediment = false},
};

/// The mean of a cross-section over all directions within a small angle of vertical. The steps are
/// even in the logarithm of the angle, so that the mean includes lobes of any width.
double mean_about_vertical(const Backscatter& model, double within_rad) {
  constexpr double narrowest_rad = 1e-14, ratio = 0.97;
  double sum = 0.0, weights = 0.0;
  for (double off_rad = within_rad * std::sqrt(ratio); off_rad > narrowest_rad; off_rad *= ratio) {
    const double weight = off_rad * off_rad;
    sum += weight * model.cross_section(pi / 2.0 - off_rad);
    weights += weight;
  }
  return sum / weights;
}

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

std::span<const BottomModelKind> bottom_model_kinds() { return models; }

const BottomModelKind& bottom_model_kind(std::string_view name) {
  return kind_named(models, "bottom model", name);
}

double gentle_relief_weight(double slope) {
  return interpolation_weight((std::atan(slope) * 180.0 / pi - 7.0) / 0.5);
}

Bottom::Bottom(const Sediment& sediment, double frequency_hz, double sound_speed_mps,
               std::string_view model, double resolved_slope_fraction)
    : offset_(from_db(sediment.strength_offset_db)) {
  BottomConditions bed{
      .sediment = sediment,
      .frequency_hz = frequency_hz,
      .sound_speed_mps = sound_speed_mps,
      .k_per_cm = relief_wavenumber_per_cm(sediment, frequency_hz, sound_speed_mps)};
  check(sediment);
  if (!(resolved_slope_fraction >= 0.0 && resolved_slope_fraction <= 1.0))
    throw std::invalid_argument(
        fmt::format("the resolved slope fraction is {}, expected 0 to 1", resolved_slope_fraction));
  bed.slope = rms_slope(sediment, bed.k_per_cm);
  bed.unresolved_slope = bed.slope * std::sqrt(1.0 - resolved_slope_fraction);
  model_ = bottom_model_kind(model).make(bed);
}

double Bottom::cross_section(double grazing_rad) const {
  const BottomTerms sum = terms(grazing_rad);
  return offset_ * (sum.roughness + sum.volume);
}

BackscatterTable::BackscatterTable(const Backscatter& model, double resolved_rad) {
  const double mean = resolved_rad > 0.0 ? mean_about_vertical(model, resolved_rad) : 0.0;
  // Written with `!`, so that an infinite strength at vertical counts as a narrow lobe, too.
  const bool spread = resolved_rad > 0.0 && !(model.cross_section(pi / 2.0) <= 2.0 * mean);
  const double from_rad = spread ? pi / 2.0 - resolved_rad : pi;
  const auto quotient = [&](double grazing_rad) {
    const double sigma = grazing_rad > from_rad ? mean : model.cross_section(grazing_rad);
    return static_cast<float>(sigma / std::sin(grazing_rad));
  };
  constexpr std::uint64_t last = std::bit_cast<std::uint64_t>(highest);
  for (std::uint64_t bits = lowest_bits; bits < last; bits += std::uint64_t{1} << cell_bits)
    quotient_.push_back(quotient(std::atan(std::sqrt(std::bit_cast<double>(bits)))));
  quotient_.resize(quotient_.size() + 2, quotient(pi / 2.0));  // the last cell is for x = highest
}

}  // namespace ensonify::scatter
