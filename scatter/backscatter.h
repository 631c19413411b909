#pragma once

#include <array>

namespace ensonify::scatter {

/// How strongly a surface sends sound back: the scattering cross-section per unit area and unit
/// solid angle (linear, not decibels), over the grazing angle in [0, pi/2].
class Backscatter {
 public:
  virtual ~Backscatter() = default;
  virtual double cross_section(double grazing_rad) const = 0;
};

/// Lambert's law, mu sin^2(grazing): Mackenzie, JASA 33, 1498 (1961), found 10 log10 mu = -27.
class Lambert final : public Backscatter {
 public:
  /// Throws std::invalid_argument above -4.97 dB (mu = 1/pi), where more would return than came.
  explicit Lambert(double mu_db = -27.0);
  double cross_section(double grazing_rad) const override;

 private:
  double mu_;
};

/// cross_section / sin(grazing) for the hot loop, by linear interpolation: over the sine up to 45
/// degrees, over the cosine beyond, so that it is fine both at grazing and near vertical. The
/// quotient is what a ray's solid angle is multiplied by, and stays finite at grazing.
class BackscatterTable {
 public:
  explicit BackscatterTable(const Backscatter& model);
  /// sin_grazing in [0, 1].
  double over_sine(double sin_grazing) const;

 private:
  static constexpr int cells = 1024;
  std::array<double, cells + 2> by_sine_;
  std::array<double, cells + 2> by_cosine_;
};

}  // namespace ensonify::scatter
