#pragma once

#include <memory>
#include <vector>

#include <ensonify/scatter/backscatter.h>

namespace ensonify::scatter {

/// Backscatter strengths as a function of the grazing angle, at one frequency.
struct StrengthCurve {
  double frequency_hz = 0.0;
  std::vector<double> grazing_rad;  ///< from 0 to pi/2, increasing, two or more
  std::vector<double> strength_db;  ///< one for each angle
};

/// Measured backscatter strengths: curves by increasing frequency. A single curve is for all
/// frequencies.
class StrengthTable {
 public:
  /// Throws std::invalid_argument if a rule above is broken, and if a strength is not finite.
  explicit StrengthTable(std::vector<StrengthCurve> curves);
  const std::vector<StrengthCurve>& curves() const { return curves_; }

 private:
  std::vector<StrengthCurve> curves_;
};

/// The strength of a table at one frequency. The strength in decibels is interpolated linearly over
/// the grazing angle, and between two curves linearly over the logarithm of the frequency. Outside
/// the table's frequencies the nearest curve is used. Above a curve's last angle, its last strength
/// is used. Below the first angle the strength falls from the first strength by Lambert's law,
/// because a constant strength would return more energy than arrives (energy_bound.h).
class MeasuredBottom final : public Backscatter {
 public:
  /// `offset_db` is added to all strengths.
  MeasuredBottom(std::shared_ptr<const StrengthTable> table, double frequency_hz,
                 double offset_db = 0.0);
  double cross_section(double grazing_rad) const override;

 private:
  std::shared_ptr<const StrengthTable> table_;
  const StrengthCurve* below_;  // the curves of the next lower and next higher frequency
  const StrengthCurve* above_;
  double weight_of_above_ = 0.0;
  double offset_db_;
};

}  // namespace ensonify::scatter
