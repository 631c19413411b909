#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include <ensonify/engine/base/input_file.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/sonar/instrument/sector.h>
#include <ensonify/engine/sonar/instrument/shading.h>

namespace ensonify::engine {

/// One-way power pattern of a line array as a function of the angle psi from its broadside plane.
struct LineArray {
  double length_m;
  double wavelength_m;
  Shading shading = {};

  /// The pattern in the far field or of a focused array: Shading::far_field() squared, which is
  /// sinc^2(L sin(psi) / lambda) for a uniform array. It is 1 on the axis.
  double power(double sin_psi) const;
  /// The pattern at a range, relative to the axis in the far field: |Shading::field()|^2 with x = L
  /// sin(psi) / lambda and F = L^2 / (2 lambda r) times the defocus. The range must be at least the
  /// array's length, because Fresnel's approximation fails nearer. defocus: Sonar::defocus(); 1 if
  /// not focused.
  double power(double sin_psi, double range_m, double defocus = 1.0) const;
  /// F as in power().
  double nearness(double range_m, double defocus) const {
    return 0.5 * length_m * length_m / (wavelength_m * range_m) * defocus;
  }
  /// Half the beam's width at a range: out to x = L sin(psi) / lambda in the far field, plus half
  /// the array's length in the near field. `widening`: the factor by which shading widens the main
  /// lobe; half the array's length is divided by it.
  double half_width_m(double x, double range_m, double defocus, double widening = 1.0) const {
    return 0.5 * length_m / widening * std::abs(defocus) + x * wavelength_m * range_m / length_m;
  }
  /// psi of null `number` in the far field: asin(n lambda / L) for a uniform array. A right angle
  /// if there is no null of this number.
  double null_rad(int number) const;

  bool operator==(const LineArray&) const = default;
};

/// By what angle beyond the traced lobes a two-way beam is summed; at most most_rad
/// (Sonar::lobes_beyond()). If one array lies or looks to the side of the other by aside_rad, and
/// this is more than half of the transmitter's lobes, the product of their patterns also has power
/// in the next lobes.
inline double next_lobe_rad(double aside_rad, double transmit_lobes_rad, double most_rad) {
  if (aside_rad <= 0.5 * transmit_lobes_rad) return 0.0;
  return std::min(aside_rad - 0.25 * transmit_lobes_rad, most_rad);
}

/// One measured level of a vertical pattern.
struct VerticalLevel {
  double depression_rad;
  double level_db;  ///< one-way power below the peak
};

/// One-way power pattern of each sector as a function of depression: measured levels, or the sinc^2
/// pattern of an element with a given -3 dB width, which is tilted down. A width of 0 means the
/// same power in all directions.
struct VerticalPattern {
  double beamwidth_rad = 50.0 * degree;  ///< -3 dB to -3 dB
  double tilt_rad = 20.0 * degree;       ///< of the axis below the horizontal
  InputFile file;                        ///< file of the measured levels
  /// By Sector::number, depressions ascending; empty: not measured.
  std::array<std::vector<VerticalLevel>, 2> measured;
  // A ripple, like the ripple by side lobes: a cosine of the depression, in dB.
  double ripple_db = 0.0;  ///< from its maximum to its minimum
  double ripple_period_rad = 20.0 * degree;
  double ripple_dark_rad = 30.0 * degree;  ///< the depression of a minimum
  /// The level is never below this; unset: -20 dB, or no floor for measured levels.
  std::optional<double> floor_db;
  /// The floor between the axis and the element's back, which begins at a right angle below the
  /// axis, and at least straight down. There, real elements have no deep nulls. Unset: floor_db.
  std::optional<double> floor_below_db;
  double port_mount_rad = 0.0;  ///< how far the side's pattern, with its ripple, is turned down
  double starboard_mount_rad = 0.0;

  /// The power towards a depression, 1 at the peak of an element. Measured levels are interpolated
  /// linearly in dB; beyond them the last level holds.
  double power(double depression_rad, const Sector& sector) const;
};

}  // namespace ensonify::engine
