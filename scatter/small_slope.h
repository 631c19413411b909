#pragma once

#include <complex>
#include <vector>

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// I(p) = integral over u from 0 to infinity of J0(u) exp(-p u^(2 alpha)) u: the Kirchhoff integral
/// of a power-law relief. Integrated along a ray u = x e^(i psi) of the complex plane, where J0, as
/// the real part of the Hankel function H0, decays instead of oscillating.
class ReliefIntegral {
 public:
  /// alpha in (0, 1].
  explicit ReliefIntegral(double alpha);
  /// p > 0.
  double operator()(double p) const;

 private:
  struct Node {
    double power;                 ///< x^(2 alpha)
    std::complex<double> weight;  ///< of the quadrature over ln x, times u H0(u)
  };
  double alpha_;
  std::complex<double> turn_;  // e^(2 i alpha psi)
  std::vector<Node> nodes_;
};

/// Interface roughness of a fluid sediment by the small-slope approximation: Jackson and
/// Richardson, High-Frequency Seafloor Acoustics (2007), ch. 13. It becomes perturbation theory far
/// from vertical and the Kirchhoff integral near it.
class SmallSlope {
 public:
  /// Throws std::invalid_argument as check() and wavenumber_per_cm() do.
  SmallSlope(const Sediment& sediment, double frequency_hz, double sound_speed_mps);
  /// Linear; grazing_rad in [0, pi/2].
  double cross_section(double grazing_rad) const;

 private:
  Sediment sediment_;
  double k_;    // rad/m
  double Ch2_;  // of D(r) = Ch2 r^(2 alpha), m^(2 - 2 alpha)
  ReliefIntegral integral_;
};

}  // namespace ensonify::scatter
