#pragma once

#include <functional>

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// s, the rms slope of the relief that is large compared with the wavelength: TR 9407 eq. 42.
double rms_slope(const Sediment& sediment, double k_per_cm);

/// K_c, the wavenumber up to which the relief's slope variance is s^2, rad/m: (2 pi w2 k^2 /
/// alpha)^(1/(2 alpha)), from integrating K^2 W2(K).
double slope_cutoff_rad_per_m(const Sediment& sediment, double k_per_cm);

/// The part of s^2, 0 to 1, that a mesh already contains if it has this relief down to its own
/// spacing, that is up to the wavenumber pi/spacing.
double resolved_slope_fraction(const Sediment& sediment, double k_per_cm, double spacing_m);

/// The share of a surface with Gaussian slopes that is not in its own shadow: TR 9407 eqs 43-45.
double shadowing(double grazing_rad, double slope);

/// The mean of a cross-section over large-scale slopes, by three-point Gauss-Hermite quadrature;
/// arguments are kept within 0 to 90 degrees: TR 9407 eqs 46-49.
double slope_average(const std::function<double(double)>& cross_section, double grazing_rad,
                     double slope);

/// First-order perturbation of a flat interface; linear: TR 9407 eqs 50-52.
double perturbation(const Sediment& sediment, double k_per_cm, double grazing_rad);

/// Small roughness on large slopes; linear: TR 9407 eq. 41. `slope` is s, or the part of it that
/// the mesh does not show.
double composite_roughness(const Sediment& sediment, double k_per_cm, double grazing_rad,
                           double slope);

}  // namespace ensonify::scatter
