#pragma once

namespace ensonify::scatter {

/// A sea surface under a steady wind, seen from below, after APL-UW TR 9407 (1994), section II; for
/// 10..100 kHz, and extrapolated beyond. The report gives an accuracy of 4 dB for winds above 8 m/s
/// and 5 dB below.
struct SeaSurface {
  double wind_mps = 0.0;        ///< 10 m above the surface, 0..60
  double frequency_hz = 100e3;  ///< above 0
};

// Below, the grazing angle is in [0, pi/2]; cross-sections are linear, per unit area and unit solid
// angle, and go to zero with the angle. All throw std::invalid_argument for other arguments.

/// Backscatter of the bubble layer beneath the surface, eqs. 2 to 6.
double bubble_cross_section(const SeaSurface& surface, double grazing_rad);

/// The mean square slope of the surface's facets, of both directions together, eq. 12.
double facet_slope2(const SeaSurface& surface);

/// The loss of the echo of the surface's facets and ripples, down and up through the bubbles,
/// eq. 28. Infinite at zero grazing.
double bubble_loss_db(const SeaSurface& surface, double grazing_rad);

/// Backscatter of facets that face the sonar, eqs. 11 and 12.
double facet_cross_section(const SeaSurface& surface, double grazing_rad);

/// Bragg backscatter of the small-scale waves, eqs. 9 and 10; zero above 85 degrees.
double ripple_cross_section(const SeaSurface& surface, double grazing_rad);

/// The total: facets and ripples, joined where the facets' lobe has fallen by 15 dB and attenuated
/// by the bubbles, plus the bubbles themselves, eqs. 1, 13 to 16.
double surface_cross_section(const SeaSurface& surface, double grazing_rad);

}  // namespace ensonify::scatter
