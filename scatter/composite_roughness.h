#pragma once

#include <functional>

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// s, the rms slope of the relief that is large beside the wavelength: TR 9407 eq. 42.
double rms_slope(const Sediment& sediment, double k_per_cm);

/// K_c, the wavenumber up to which the relief's slope variance is s^2, rad/m: (2 pi w2 k^2 /
/// alpha)^(1/(2 alpha)), from integrating K^2 W2(K).
double slope_cutoff_rad_per_m(const Sediment& sediment, double k_per_cm);

/// The part of s^2 that a mesh already has which carries this relief down to its own spacing, hence
/// up to the wavenumber pi/spacing; 0 to 1.
double resolved_slope_fraction(const Sediment& sediment, double k_per_cm, double spacing_m);

/// Share of a surface with Gaussian slopes that is not in its own shadow: TR 9407 eqs 43-45.
double shadowing(double grazing_rad, double slope);

/// Mean of a cross-section over large-scale slopes, by three points of Gauss and Hermite, arguments
/// being kept in 0 to 90 degrees: TR 9407 eqs 46-49.
double slope_average(const std::function<double(double)>& cross_section, double grazing_rad,
                     double slope);

/// First-order perturbation of a flat interface; linear: TR 9407 eqs 50-52.
double perturbation(const Sediment& sediment, double k_per_cm, double grazing_rad);

/// Small roughness on large slopes; linear: TR 9407 eq. 41. The slope is s, or what the mesh leaves
/// of it.
double composite_roughness(const Sediment& sediment, double k_per_cm, double grazing_rad,
                           double slope);

}  // namespace ensonify::scatter
