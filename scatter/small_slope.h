#pragma once

#include <complex>
#include <vector>

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// I(p) = integral over u from 0 to infinity of J0(u) exp(-p u^(2 alpha)) u: the Kirchhoff integral
/// of relief with a power law. J0 is the real part of the Hankel function H0, which decays along a
/// line u = x e^(i psi) of the complex plane instead of oscillating, so the integral is computed
/// along this line.
class ReliefIntegral {
 public:
  /// alpha in (0, 1].
  explicit ReliefIntegral(double alpha);
  /// p > 0.
  double operator()(double p) const;

 private:
  struct Node {
    double power;                 ///< x^(2 alpha)
    std::complex<double> weight;  ///< step of ln x, times du / d(ln x), times u H0(u)
  };
  double alpha_;
  std::complex<double> turn_;  // e^(2 i alpha psi)
  std::vector<Node> nodes_;
};

/// Backscatter of the interface roughness of a fluid sediment, by the small-slope approximation:
/// Jackson and Richardson, High-Frequency Seafloor Acoustics (2007), ch. 13. Far from vertical it
/// equals perturbation theory, near vertical the Kirchhoff integral.
class SmallSlope {
 public:
  /// Throws what check() and wavenumber_per_cm() throw.
  SmallSlope(const Sediment& sediment, double frequency_hz, double sound_speed_mps);
  /// Per unit area and unit solid angle (linear); grazing_rad in [0, pi/2].
  double cross_section(double grazing_rad) const;

 private:
  Sediment sediment_;
  double k_;    // rad/m
  double Ch2_;  // factor of D(r) = Ch2 r^(2 alpha), m^(2 - 2 alpha)
  ReliefIntegral integral_;
};

}  // namespace ensonify::scatter
