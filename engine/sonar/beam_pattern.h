#pragma once

namespace ensonify::engine {

/// One-way power pattern of a uniform line array, sinc^2(L sin(psi) / lambda), over the angle from its
/// broadside plane; far field.
struct LineArray {
  double length_m;
  double wavelength_m;

  double power(double sin_psi) const;
  /// psi of the first null, asin(lambda / L); a right angle for arrays shorter than a wavelength.
  double first_null_rad() const;
  /// Equivalent width of transmit x receive, the integral of sinc^4 over psi: 2/3 lambda / L.
  double two_way_width_rad() const { return 2.0 / 3.0 * wavelength_m / length_m; }
};

/// One-way power pattern over depression: the sinc^2 of an element with a given -3 dB width, tilted
/// down, never below a floor. A width of 0 is the same in all directions.
struct VerticalPattern {
  double beamwidth_rad = 0.8726646259971648;  ///< 50 degrees, -3 dB to -3 dB
  double tilt_rad = 0.3490658503988659;       ///< 20 degrees, of the axis below the horizontal
  double floor_db = -20.0;                    ///< below the peak

  double power(double depression_rad) const;
};

}  // namespace ensonify::engine
