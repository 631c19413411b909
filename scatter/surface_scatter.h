#pragma once

namespace ensonify::scatter {

/// A sea surface under a steady wind, seen from below, after APL-UW TR 9407 (1994), section II. The
/// report is for 10..100 kHz; other frequencies are extrapolated. The report states an accuracy of
/// 4 dB for winds above 8 m/s and of 5 dB for slower winds.
struct SeaSurface {
  double wind_mps = 0.0;        ///< 10 m above the surface, 0..60
  double frequency_hz = 100e3;  ///< above 0
};

// For all functions below, the grazing angle is in [0, pi/2]. Cross-sections are linear, per unit
// area and unit solid angle, and become 0 when the angle becomes 0. All functions throw
// std::invalid_argument for arguments outside these ranges.

/// Backscatter of the bubble layer beneath the surface, eqs. 2 to 6.
double bubble_cross_section(const SeaSurface& surface, double grazing_rad);

/// The mean square slope of the surface's facets, the sum over both horizontal directions, eq. 12.
double facet_slope2(const SeaSurface& surface);

/// The loss that the echo of the facets and ripples has in the bubbles on both ways, eq. 28.
/// Infinite if the grazing angle is 0.
double bubble_loss_db(const SeaSurface& surface, double grazing_rad);

/// Backscatter of facets that face the sonar, eqs. 11 and 12.
double facet_cross_section(const SeaSurface& surface, double grazing_rad);

/// Bragg backscatter of the small-scale waves, eqs. 9 and 10; zero above 85 degrees.
double ripple_cross_section(const SeaSurface& surface, double grazing_rad);

/// The total backscatter, eqs. 1, 13 to 16: facets and ripples, attenuated by the bubbles, plus the
/// bubbles themselves. Ripples replace facets at the angle where the facets' lobe has fallen by 15
/// dB.
double surface_cross_section(const SeaSurface& surface, double grazing_rad);

}  // namespace ensonify::scatter
