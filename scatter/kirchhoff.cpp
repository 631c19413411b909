#include <ensonify/scatter/kirchhoff.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/log_gamma.h>
#include <ensonify/scatter/reflection.h>

namespace ensonify::scatter {

using std::numbers::pi;

KirchhoffShape kirchhoff_shape(const Sediment& sediment, double k_per_cm) {
  const double a = sediment.alpha();
  KirchhoffShape shape;
  shape.Ch2 = 2.0 * pi * sediment.strength_cm4 * std::tgamma(2.0 - a) * std::pow(2.0, -2.0 * a) /
              (a * (1.0 - a) * std::tgamma(1.0 + a));
  shape.qc = shape.Ch2 * std::pow(2.0, 1.0 - 2.0 * a) * std::pow(k_per_cm, 2.0 * (1.0 - a));
  // Computed with logarithms, because Gamma(1/alpha) overflows for exponents near 2.
  const double ln_A = 2.0 * a *
                      (std::log(8.0 * a * a) + log_gamma(0.5 / a + 0.5) - log_gamma(0.5) -
                       log_gamma(1.0 / a) - log_gamma(0.5 / a));
  shape.A = std::exp(ln_A);
  shape.B = std::exp((0.5 + 0.5 / a) * ln_A + log_gamma(1.0 / a)) / (2.0 * a);
  return shape;
}

double kirchhoff(const Sediment& sediment, double k_per_cm, double grazing_rad) {
  if (grazing_rad < 40.0 * degree || sediment.smooth()) return 0.0;
  const double a = sediment.alpha();
  const auto [Ch2, qc, A, B] = kirchhoff_shape(sediment, k_per_cm);
  const double R2 = std::norm(reflection_coefficient(sediment, pi / 2.0));
  const double sine = std::sin(grazing_rad);
  const double cosine = std::sin(pi / 2.0 - grazing_rad);  // exactly 0 at vertical; cos() is not
  const double bracket = std::pow(cosine, 4.0 * a) + A * qc * qc * std::pow(sine, 4.0);
  constexpr double strongest = 1e100;  // exponents near 2 may give infinity at vertical
  return std::min(B * qc * R2 / (8.0 * pi * std::pow(bracket, (1.0 + a) / (2.0 * a))), strongest);
}

double kirchhoff_end_cosine(const Sediment& sediment, double k_per_cm) {
  const double a = sediment.alpha();
  const auto [Ch2, qc, A, B] = kirchhoff_shape(sediment, k_per_cm);
  const double c4 = std::pow(1000.0, 1.0 / (1.0 + a)) * std::pow(A * qc * qc, 1.0 / a);
  return std::pow(1.0 / c4 + 4.0, -0.25);
}

}  // namespace ensonify::scatter
