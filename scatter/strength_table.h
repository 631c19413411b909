#pragma once

#include <memory>
#include <vector>

#include <ensonify/scatter/backscatter.h>

namespace ensonify::scatter {

/// Backscatter strengths over the grazing angle at one frequency.
struct StrengthCurve {
  double frequency_hz = 0.0;
  std::vector<double> grazing_rad;  ///< from 0 to pi/2, increasing, two or more
  std::vector<double> strength_db;  ///< one for each angle
};

/// Measured backscatter strengths, by increasing frequency, at least one curve. A single curve is
/// used at all frequencies.
class StrengthTable {
 public:
  /// Throws std::invalid_argument unless all is as above and finite.
  explicit StrengthTable(std::vector<StrengthCurve> curves);
  const std::vector<StrengthCurve>& curves() const { return curves_; }

 private:
  std::vector<StrengthCurve> curves_;
};

/// The strength of a table at one frequency: linear in decibels over the grazing angle, and over
/// the logarithm of the frequency between two curves. Outside the table's frequencies and above a
/// curve's last angle the last value holds. Below the first angle the strength falls from the first
/// value by Lambert's law: a constant one would return more energy than arrives (energy_bound.h).
class MeasuredBottom final : public Backscatter {
 public:
  /// `offset_db` is added to all strengths.
  MeasuredBottom(std::shared_ptr<const StrengthTable> table, double frequency_hz,
                 double offset_db = 0.0);
  double cross_section(double grazing_rad) const override;

 private:
  std::shared_ptr<const StrengthTable> table_;
  const StrengthCurve* below_;  // the neighbours in frequency
  const StrengthCurve* above_;
  double weight_of_above_ = 0.0;
  double offset_db_;
};

}  // namespace ensonify::scatter
