#pragma once

#include <complex>

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// kappa, the wavenumber in the sediment divided by the wavenumber in the water: TR 9407 eq. 31.
std::complex<double> wavenumber_ratio(const Sediment& sediment);

/// P, the vertical wavenumber in the sediment divided by the wavenumber in the water: TR 9407 eq.
/// 32. It is the principal root, so its imaginary part is not negative.
std::complex<double> vertical_wavenumber_ratio(const Sediment& sediment, double grazing_rad);

/// Rayleigh's pressure reflection coefficient of a lossy fluid: TR 9407 eqs 30-33.
std::complex<double> reflection_coefficient(const Sediment& sediment, double grazing_rad);

/// The loss in the specular direction, -20 log10 |R|, dB: TR 9407 eq. 29.
double reflection_loss_db(const Sediment& sediment, double grazing_rad);

}  // namespace ensonify::scatter
