#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include <ensonify/scatter/backscatter_cells.h>
#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// How strongly a surface scatters sound back: the scattering cross-section per unit area and unit
/// solid angle (linear, not decibels) at a grazing angle in [0, pi/2].
class Backscatter {
 public:
  virtual ~Backscatter() = default;
  virtual double cross_section(double grazing_rad) const = 0;
};

/// Lambert's law, mu sin^2(grazing): Mackenzie, JASA 33, 1498 (1961), found 10 log10 mu = -27.
class Lambert final : public Backscatter {
 public:
  /// Throws std::invalid_argument above -4.97 dB (mu = 1/pi): more energy would return than
  /// arrived.
  explicit Lambert(double mu_db = -27.0);
  double cross_section(double grazing_rad) const override;

 private:
  double mu_;
};

/// The terms of a bottom's backscatter: linear cross-sections, without strength_offset_db. A term
/// that a model does not have is 0.
struct BottomTerms {
  double roughness = 0.0, volume = 0.0;                            ///< their sum is the total
  double kirchhoff = 0.0, composite = 0.0, large_roughness = 0.0;  ///< the parts of roughness
};

/// f_y, the weight of the terms `kirchhoff` and `composite`; the term `large_roughness` has the
/// weight 1 - f_y: TR 9407 eqs 63-64. `slope` is the whole rms slope s.
double gentle_relief_weight(double slope);

/// A sediment at one frequency, with the values that the models use.
struct BottomConditions {
  Sediment sediment;
  double frequency_hz = 0.0;
  double sound_speed_mps = 0.0;   ///< of the water at the bed
  double k_per_cm = 0.0;          ///< relief_wavenumber_per_cm()
  double slope = 0.0;             ///< rms slope of the relief
  double unresolved_slope = 0.0;  ///< rms slope of the part of the relief that no mesh shows
};

/// Computes the backscatter of a bottom at a grazing angle in [0, pi/2] by one model, for the
/// conditions that it was made with.
using BottomModel = std::function<BottomTerms(double grazing_rad)>;

/// A model with a name for scenes and for the command line.
struct BottomModelKind {
  std::string_view name;
  std::string_view help;  ///< a few words
  BottomModel (*make)(const BottomConditions&);
  bool by_sediment = true;  ///< whether the model depends on the sediment's parameters
};

/// All models, the default one first. A new model is a row here.
std::span<const BottomModelKind> bottom_model_kinds();
/// The model with this name; - and _ count as equal. Throws std::invalid_argument, with a list of
/// all names, for an unknown one.
const BottomModelKind& bottom_model_kind(std::string_view name);

/// A sediment at one frequency: 10 log10(roughness + volume) + strength_offset_db, TR 9407 eq. 34.
class Bottom final : public Backscatter {
 public:
  /// `model` is a name as for bottom_model_kind(). `resolved_slope_fraction`
  /// (composite_roughness.h) is the part of the slope variance s^2 that the mesh itself shows;
  /// slope average and shadowing use only the rest of the variance. Throws as check(),
  /// wavenumber_per_cm() and bottom_model_kind(), and std::invalid_argument if the fraction is
  /// outside [0, 1].
  Bottom(const Sediment& sediment, double frequency_hz, double sound_speed_mps,
         std::string_view model = "tr9407", double resolved_slope_fraction = 0.0);

  /// Below 0.001 degrees, the terms at 0.001 degrees (TR 9407 IV.C.4), except for Lambert's law.
  BottomTerms terms(double grazing_rad) const { return model_(grazing_rad); }
  double cross_section(double grazing_rad) const override;

 private:
  double offset_;  // a factor
  BottomModel model_;
};

/// A table of cross_section / sin(grazing) for the innermost loop. A ray's solid angle is
/// multiplied by this quotient, which stays finite when the grazing angle becomes 0.
///
/// The quotient is interpolated linearly over the squared tangent of the grazing angle, in 64 equal
/// cells between each two powers of two. So cells are fine both at small grazing angles and near
/// vertical, and the code needs no branch. The error is less than 0.02 dB for all named sediments
/// from 0.05 degrees up, at 10 kHz to 1 MHz.
class BackscatterTable {
 public:
  /// If the model has a lobe around vertical that is much narrower than `resolved_rad`, its energy
  /// is spread evenly over that angle. A lobe counts as this narrow if the strength at vertical is
  /// more than twice the mean within the angle. If resolved_rad is 0, no lobe is spread.
  explicit BackscatterTable(const Backscatter& model, double resolved_rad = 0.0);

  /// sin_grazing in [0, 1]; below 0.0035 degrees returns the value at 0.0035 degrees.
  double sigma_over_sine(double sin_grazing) const {
    const double sine2 = sin_grazing * sin_grazing;
    const double x = std::max(lowest, std::min(highest, sine2 / std::abs(1.0 - sine2)));
    const auto bits = std::bit_cast<std::uint64_t>(x);
    const float* const cell = &quotient_[(bits >> cell_bits) - (lowest_bits >> cell_bits)];
    // The low bits of the significand are the place of x in its cell, here the fraction of a number
    // in [1, 2).
    const double place =
        std::bit_cast<double>((bits << (52 - cell_bits) & significand) | one) - 1.0;
    return cell[0] + place * (cell[1] - cell[0]);
  }

  /// The values at the cells' ends, from backscatter_cells::lowest on.
  std::span<const float> values() const { return quotient_; }

 private:
  static constexpr double lowest = backscatter_cells::lowest;
  static constexpr double highest = backscatter_cells::highest;
  static constexpr int cell_bits = 52 - backscatter_cells::cells_per_octave_bits;
  static constexpr std::uint64_t one = std::bit_cast<std::uint64_t>(1.0);
  static constexpr std::uint64_t significand = (std::uint64_t{1} << 52) - 1;
  static constexpr std::uint64_t lowest_bits = std::bit_cast<std::uint64_t>(lowest);

  std::vector<float> quotient_;  // at the cells' ends
};

}  // namespace ensonify::scatter
