#pragma once

#include <functional>

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// s, the rms slope of the relief that is large compared with the wavelength: TR 9407 eq. 42.
double rms_slope(const Sediment& sediment, double k_per_cm);

/// K_c, in rad/m: the relief up to this wavenumber has the slope variance s^2. K_c = (2 pi w2 k^2 /
/// alpha)^(1/(2 alpha)) follows from integrating K^2 W2(K).
double slope_cutoff_rad_per_m(const Sediment& sediment, double k_per_cm);

/// The part of s^2, 0 to 1, that a mesh already contains. The mesh has this relief down to the
/// spacing of its vertices, that is up to the wavenumber pi/spacing.
double resolved_slope_fraction(const Sediment& sediment, double k_per_cm, double spacing_m);

/// The share of a surface with Gaussian slopes that is not in its own shadow: TR 9407 eqs 43-45.
double shadowing(double grazing_rad, double slope);

/// The mean of a cross-section over large-scale slopes, by three-point Gauss-Hermite quadrature: TR
/// 9407 eqs 46-49. The cross-section is evaluated only within 0 to 90 degrees.
double slope_average(const std::function<double(double)>& cross_section, double grazing_rad,
                     double slope);

/// The backscattering cross-section (linear) of a slightly rough, otherwise flat interface, by
/// first-order perturbation theory: TR 9407 eqs 50-52.
double perturbation(const Sediment& sediment, double k_per_cm, double grazing_rad);

/// The backscattering cross-section (linear) of small roughness on large slopes: TR 9407 eq. 41.
/// `slope` is the rms slope s, or the part of s that the mesh does not show.
double composite_roughness(const Sediment& sediment, double k_per_cm, double grazing_rad,
                           double slope);

/// The critical angle, in degrees: below it sound is reflected totally. 2.5613 for a bed in which
/// sound is not faster than in the water: TR 9407 eq. 54.
double critical_angle_deg(const Sediment& sediment);

/// The backscattering cross-section (linear) of relief that is steep everywhere: an empirical
/// formula that was fitted to gravel and rock, TR 9407 eqs 53-56. `slope` is the whole rms slope s.
double large_roughness(const Sediment& sediment, double grazing_rad, double slope);

/// The backscattering cross-section (linear) of inhomogeneities below a flat interface: TR 9407 eq.
/// 66. If the loss is 0, returns the limit of small loss.
double flat_sediment_volume(const Sediment& given, double grazing_rad);

/// The same below large-scale slopes, averaged and shadowed like composite roughness: TR 9407 eq.
/// 65. `slope` is the rms slope s, or the part of s that the mesh does not show.
double sediment_volume(const Sediment& sediment, double grazing_rad, double slope);

}  // namespace ensonify::scatter
