#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/sonar/echo/echo.h>
#include <ensonify/scatter/ground_texture.h>

namespace ensonify::engine {

/// Where the ground scatters more than its mean and where less; the pattern is fixed to the ground
/// (GroundTexture).
///
/// The patches of a material are the squares of a grid in local coordinates. A patch's share of the
/// cross-section depends only on the seed and the patch; the grazing angle changes the
/// distribution, not the order. Scatterers (scatterers.h) are as strong as the patch that they lie
/// on. They are samples of the ground, one bin apart over range: a simulated echo sums a few of
/// them, and a real echo sums all ground of its cell. As the cell covers several patches or parts
/// of patches, the real strength varies less. To correct for this, the shape of the distribution of
/// a scatterer's strength is larger than the shape for a patch, by the ratio of the two variances.
/// With the weights w of samples, or of all ground, a sum has the share
///
///   sum w w' C / (sum w)^2
///
/// of a patch's variance. Here C is the probability that two places at the distance d lie on one
/// patch, 1 - d / side. So the echo has the second moment of the ground, for bins of any length.
/// The moment is within 2 % if the array lies along the patches' grid. If the array is turned by 45
/// degrees against the grid, the moment is up to 17 % too large where the scatterers lie as far
/// apart along the array as patches, and elsewhere within 8 %.
class TexturedGround {
 public:
  /// Places at even steps of slant range, each with its part in the power of an echo.
  struct RangeWeights {
    double step_m;
    std::vector<double> weights;
  };
  /// By material; empty: the ground is even. `samples`: the scatterers of an echo, one for each of
  /// its bins; `pulse`: the intensity of the pulse, in steps that are small against it.
  TexturedGround(const std::vector<scatter::GroundTexture>& by_material,
                 const RangeWeights& samples, const RangeWeights& pulse, std::uint64_t seed);

  /// Whether no material has patches or glints.
  bool without_patches() const { return !patchy_; }
  /// The key for hashing a patch's number.
  std::uint32_t key() const { return key_; }
  /// The values of all rows (scatter::GammaTable).
  static const scatter::GammaTable& quantiles();

  /// The patches under the scatterers of each bin, in whole groups (signal_kernel.h).
  struct Places {
    // Place of the bin's first scatterer, and the step to the next one, in 4096ths of a patch:
    std::vector<std::uint32_t> x, y, step_x, step_y;
    std::vector<std::uint32_t> row, glint_row;  ///< where rows begin in quantiles()
    std::vector<float> glint_share;
    std::vector<float> strengths;  ///< of all scatterers, as sum_cells() computes them
    bool known = false;            ///< whether sum_cells() has computed them
  };
  /// A bin's first scatterer, local metres; the step from a scatterer to the next; and rows_of()
  /// the length of this step.
  struct Scatterer {
    double x_m, y_m, step_x_m, step_y_m;
    float step_rows;
  };
  /// A length as rows of quantiles(): 8 times log2 of the length in metres.
  static float rows_of(double length_m);
  /// Sets the patches of bin n, whose echo comes from `material` at that grazing angle.
  void place(std::size_t n, std::uint32_t material, float grazing_rad, const Scatterer& first,
             Places& places) const;
  /// Gives bin n no patches: its ground scatters evenly.
  static void leave_even(std::size_t n, Places& places);

  /// Multiplies the expected echo of each bin by the slow variation of its material's strength
  /// there, a factor of mean 1. It is computed once per group of bins and material.
  void vary(const BinLayers& bins, std::span<float> direct) const;

 private:
  struct OfAngle {
    float row, glint_row, glint_share;
    float even_glint_row;  // from this row on, glints change nothing that can be seen
    float variation;       // share of the slow variation that is left
  };
  struct Kind {
    scatter::GroundTexture texture;
    double units_per_m;  // 4096ths of a patch
    float patch_rows;    // rows_of() a patch
    std::vector<OfAngle> of_angle;
    std::vector<float> octaves;  // amplitudes of ln intensity, from the longest scale on
  };
  float along_rows(float step_rows) const;
  const OfAngle& at_angle(const Kind& kind, float grazing_rad) const;
  float variation(const Kind& kind, double x_m, double y_m, float grazing_rad) const;
  const Kind* kind_of(std::uint32_t material) const {
    return material < kinds_.size() ? &kinds_[material] : nullptr;
  }

  std::vector<Kind> kinds_;
  std::vector<float> along_rows_;  // by the scatterers' step in patches, downwards from one
  bool patchy_ = false, varies_ = false;
  std::uint32_t key_;
  double along_x_, along_y_;  // of the unit vector along the forms of the slow variation
};

}  // namespace ensonify::engine
