#include <ensonify/engine/seafloor/bed/ripples.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/bed/relief_fields.h>

namespace ensonify::engine {
namespace {

void check(const RippleRelief& relief) {
  const auto fail = [](const std::string& what) {
    throw std::invalid_argument("ripples: " + what);
  };
  const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
  if (!(relief.rms_height_m == 0.0 || positive(relief.rms_height_m)))
    fail(fmt::format("the rms height is {} m; it must be finite and not negative",
                     relief.rms_height_m));
  if (!positive(relief.wavelength_m))
    fail(fmt::format("the wavelength is {} m; it must be positive", relief.wavelength_m));
  if (!positive(relief.relative_width))
    fail(fmt::format("the relative width is {}; it must be positive", relief.relative_width));
  if (!std::isfinite(relief.across_crests_rad))
    fail(fmt::format("the heading across the crests is {}; it must be finite",
                     relief.across_crests_rad));
  if (!positive(relief.hurst))
    fail(fmt::format("the Hurst exponent is {}; it must be positive", relief.hurst));
}

}  // namespace

SpectralField ripple_field(const Heightfield& grid, const RippleRelief& relief) {
  check(relief);
  const double cell = std::max(grid.cell_east_m, grid.cell_north_m);
  if (relief.rms_height_m > 0.0 && !(cell <= 0.25 * relief.wavelength_m))
    throw std::invalid_argument(fmt::format(
        "ripples: cells of {} m cannot carry a wavelength of {} m; use cells of at most {} m", cell,
        relief.wavelength_m, 0.25 * relief.wavelength_m));

  const double k0 = 2.0 * std::numbers::pi / relief.wavelength_m;
  const double k0x = k0 * std::sin(relief.across_crests_rad);
  const double k0y = k0 * std::cos(relief.across_crests_rad);
  const double kw2 = std::pow(relief.relative_width * k0, 2);
  SpectralField what;
  // So that wavenumber steps are at most a quarter of the width, even for a small field.
  what.period_m = 4.0 * relief.wavelength_m / relief.relative_width;
  what.reach_m = what.period_m;
  // The correlation falls as exp(-distance * half width in wavenumber), here to exp(-7.6) = 5e-4.
  what.regular_m = 7.6 / (relief.relative_width * k0);
  what.amplitude = [=, exponent = -0.5 * (relief.hurst + 1.0)](double kx, double ky) {
    const auto around = [&](double cx, double cy) {
      return std::pow((kx - cx) * (kx - cx) + (ky - cy) * (ky - cy) + kw2, exponent);
    };
    return around(k0x, k0y) + around(-k0x, -k0y);
  };
  what.weight = [](double, double) { return 1.0; };
  what.calibrated_m2 = relief.rms_height_m * relief.rms_height_m;
  return what;
}

void add_ripples(Heightfield& field, const RippleRelief& relief, std::uint64_t seed,
                 const WorkControl& control) {
  const SpectralField what = ripple_field(field, relief);
  if (relief.rms_height_m > 0.0)
    add_spectral_field(field, what, RandomStream(seed, Purpose::ripple_relief), control);
}

}  // namespace ensonify::engine
