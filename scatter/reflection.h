#pragma once

#include <complex>

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// kappa, the sediment's wavenumber over the water's: TR 9407 eq. 31.
std::complex<double> wavenumber_ratio(const Sediment& sediment);

/// P, the vertical wavenumber in the sediment over the water's wavenumber: TR 9407 eq. 32, the
/// principal root, whose imaginary part is not negative.
std::complex<double> vertical_wavenumber_ratio(const Sediment& sediment, double grazing_rad);

/// Rayleigh's pressure reflection coefficient of a lossy fluid: TR 9407 eqs 30-33.
std::complex<double> reflection_coefficient(const Sediment& sediment, double grazing_rad);

/// The loss in the specular direction, -20 log10 |R|, dB: TR 9407 eq. 29.
double reflection_loss_db(const Sediment& sediment, double grazing_rad);

}  // namespace ensonify::scatter
