#include <ensonify/scatter/small_slope.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ensonify/scatter/kirchhoff.h>
#include <ensonify/scatter/reflection.h>

namespace ensonify::scatter {
namespace {

using Complex = std::complex<double>;
using std::numbers::pi;

constexpr Complex i{0.0, 1.0};

/// The modified Bessel function K0(w), for arg w within 68 degrees of 0. It is the integral of
/// exp(-w cosh t) over t, by the trapezoidal rule, which converges geometrically.
Complex bessel_k0(Complex w) {
  if (std::abs(w) < 1e-6) return -std::log(0.5 * w) - std::numbers::egamma;
  constexpr double step = 1.0 / 16.0;
  Complex sum = 0.5 * std::exp(-w);
  for (int n = 1;; ++n) {
    const Complex term = std::exp(-w * std::cosh(n * step));
    sum += term;
    if (std::abs(term) < 1e-18 * std::abs(sum) || term == 0.0) return step * sum;
  }
}

/// The Hankel function H0 of the first kind: Abramowitz and Stegun 9.6.4.
Complex hankel0(Complex u) { return 2.0 / (pi * i) * bessel_k0(-i * u); }

/// exp(z) - 1, precise for small z.
Complex exp_minus_1(Complex z) {
  const double half_sine = std::sin(0.5 * z.imag());
  return {std::expm1(z.real()) * std::cos(z.imag()) - 2.0 * half_sine * half_sine,
          std::exp(z.real()) * std::sin(z.imag())};
}

constexpr double ln_step = 1.0 / 14.0;  // between nodes, in ln x
constexpr double first_ln_x = -60.0;    // smaller x count only where the result is negligible

}  // namespace

// On the turned path, the exponent p u^(2 alpha) is turned by 2 alpha psi = 45 degrees, halfway to
// the angle at which the exponential no longer decays. The integrand is analytic within the same
// angle on both sides of the path; the step's precision depends on this.
ReliefIntegral::ReliefIntegral(double alpha) : alpha_(alpha) {
  const double psi = std::min(pi / 2.0, pi / (8.0 * alpha));
  turn_ = std::exp(2.0 * alpha * psi * i);
  const double last_ln_x = std::log(45.0 / std::sin(psi));
  for (int n = 0; first_ln_x + n * ln_step < last_ln_x; ++n) {
    const double x = std::exp(first_ln_x + n * ln_step);
    const Complex u = x * std::exp(psi * i);
    nodes_.push_back({std::pow(x, 2.0 * alpha), ln_step * u * u * hankel0(u)});  // du = u d(ln x)
  }
}

double ReliefIntegral::operator()(double p) const {
  // The integral of J0(u) u alone is 0 (Abel). It is subtracted where it would be the larger part.
  const bool small = p < 1.0;
  // Terms whose ln x is more than 20 below ln_scale are negligible. Terms whose exponent p x^(2
  // alpha) exceeds 60 are negligible, because of the exponential.
  const double ln_scale = small ? 0.0 : -0.5 * std::log(p) / alpha_;
  const double from = (ln_scale - 20.0 - first_ln_x) / ln_step;
  Complex sum = 0.0;
  for (std::size_t n = from > 0.0 ? static_cast<std::size_t>(from) : 0; n < nodes_.size(); ++n) {
    const double size = p * nodes_[n].power;
    if (!small && size > 60.0) break;
    const Complex z = -size * turn_;
    sum += nodes_[n].weight * (small ? exp_minus_1(z) : std::exp(z));
  }
  return std::max(0.0, sum.real());
}

SmallSlope::SmallSlope(const Sediment& sediment, double frequency_hz, double sound_speed_mps)
    : sediment_((check(sediment), sediment)),
      k_(100.0 * wavenumber_per_cm(frequency_hz, sound_speed_mps)),
      Ch2_(kirchhoff_shape(sediment, 1.0).Ch2 * std::pow(0.01, 2.0 - 2.0 * sediment.alpha())),
      integral_(sediment.alpha()) {}

double SmallSlope::cross_section(double grazing_rad) const {
  if (sediment_.smooth()) return 0.0;
  const double rho = sediment_.density_ratio, a = sediment_.alpha(), k = k_;
  const double sine = std::sin(grazing_rad), cosine = std::cos(grazing_rad);
  if (sine == 0.0) return 0.0;
  const Complex G = reflection_coefficient(sediment_, grazing_rad);
  const Complex kappa = wavenumber_ratio(sediment_);
  const double sbar = -cosine * cosine;
  const double q = k * std::sqrt(4.0 * cosine * cosine + 1e-6);  // never 0
  const double qz = 2.0 * k * sine;
  const double p = 0.5 * Ch2_ * qz * qz * std::pow(q, -2.0 * a);
  const Complex a0 = 0.5 * k * k *
                     ((sbar - 1.0 + (kappa * kappa - sbar) / rho) * (1.0 + G) * (1.0 + G) -
                      (rho - 1.0) * sine * sine * (1.0 - G) * (1.0 - G));
  return std::norm(a0) / (2.0 * pi * q * q * qz * qz) * integral_(p);
}

}  // namespace ensonify::scatter
