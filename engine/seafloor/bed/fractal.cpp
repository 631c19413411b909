#include <ensonify/engine/seafloor/bed/fractal.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/engine/seafloor/bed/relief_fields.h>

namespace ensonify::engine {

void add_fractal(Heightfield& field, const FractalRelief& relief, std::uint64_t seed,
                 const WorkControl& control) {
  add_fractal(field, relief, RandomStream(seed, Purpose::fractal_relief), control);
}

SpectralField fractal_field(const Heightfield& grid, const FractalRelief& relief) {
  const double h = relief.hurst;
  const double sigma = relief.height_at_1m_m;
  if (!(h > 0.0 && h < 1.0))
    throw std::invalid_argument(
        fmt::format("fractal relief: the Hurst exponent is {}; it must lie between 0 and 1", h));
  if (!(sigma >= 0.0 && std::isfinite(sigma)))
    throw std::invalid_argument(fmt::format(
        "fractal relief: the height at 1 m is {} m; it must be finite and not negative", sigma));
  if (!(relief.longest_m >= 0.0 && std::isfinite(relief.longest_m)))
    throw std::invalid_argument(
        fmt::format("fractal relief: the longest wave is {} m; it must be finite and not negative",
                    relief.longest_m));
  // Below k0 the spectrum is constant (von Karman's form).
  const double k0 = relief.longest_m > 0.0 ? 2.0 * std::numbers::pi / relief.longest_m : 0.0;

  SpectralField what;
  // One period for both directions: with a period for each, a long strip would have too few long
  // waves across it and too much power along it.
  what.period_m = (h > 0.7 ? 4.0 : 2.0) *
                  std::max(grid.columns * grid.cell_east_m, grid.rows * grid.cell_north_m);
  // Over this distance the correlation of von Karman's form falls to less than 5e-4.
  what.reach_m = 1.5 * relief.longest_m;
  if (relief.spectrum == FractalSpectrum::variogram) {
    // Phi(k) = C |k|^-(2H+2) is the 2-D spectrum with the variogram sigma^2 d^2H.
    const double c = sigma * sigma * std::pow(2.0, 2.0 * h - 1.0) * h * std::tgamma(1.0 + h) /
                     (std::numbers::pi * std::tgamma(1.0 - h));
    what.amplitude = [k0, root_c = std::sqrt(c), exponent = -0.5 * (h + 1.0)](double kx,
                                                                              double ky) {
      return root_c * std::pow(kx * kx + ky * ky + k0 * k0, exponent);
    };
  } else {
    // The variogram of this spectrum grows with the period. So the spectrum is scaled: half the sum
    // of the variograms 1 m to the east and 1 m to the north becomes the squared height at 1 m.
    what.amplitude = [k0, exponent = -0.5 * (2.0 * h + 1.0)](double kx, double ky) {
      return std::pow(kx * kx + ky * ky + k0 * k0, exponent);
    };
    what.weight = [](double kx, double ky) { return 2.0 - std::cos(kx) - std::cos(ky); };
    what.calibrated_m2 = sigma * sigma;
  }
  return what;
}

void add_fractal(Heightfield& field, const FractalRelief& relief, const RandomStream& noise,
                 const WorkControl& control) {
  const SpectralField what = fractal_field(field, relief);
  if (relief.height_at_1m_m != 0.0) add_spectral_field(field, what, noise, control);
}

}  // namespace ensonify::engine
