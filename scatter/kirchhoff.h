#pragma once

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// Parameters of the Kirchhoff approximation for a relief at a wavenumber: TR 9407 eqs 36-40.
struct KirchhoffShape {
  double Ch2;  ///< factor of the structure function D(r) = Ch2 r^(2 alpha), r in cm, D in cm^2
  double qc;
  double A, B;  ///< they depend only on alpha
};
KirchhoffShape kirchhoff_shape(const Sediment& sediment, double k_per_cm);

/// The backscattering cross-section (linear) of interface roughness by the Kirchhoff approximation,
/// at grazing angles from 40 degrees up; 0 below 40 degrees: TR 9407 eqs 35-40.
///
/// In the factor B of these equations, A has the exponent 1/2 + 1/(2 alpha). With this exponent the
/// formula equals the Kirchhoff integral at vertical, |R|^2 (k^2/2 pi) Gamma(1/alpha)/(2 alpha) (2
/// k^2 Ch2)^(-1/alpha), and reproduces the handbook's table 3.
double kirchhoff(const Sediment& sediment, double k_per_cm, double grazing_rad);

/// Cosine of the grazing angle below which composite roughness replaces the Kirchhoff
/// approximation: TR 9407 eqs 59-61.
double kirchhoff_end_cosine(const Sediment& sediment, double k_per_cm);

}  // namespace ensonify::scatter
