#include <ensonify/scatter/surface_scatter.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::scatter {
namespace {

using std::numbers::pi;

constexpr double degrees_per_rad = 1.0 / degree;

void check_surface(const SeaSurface& surface, double grazing_rad) {
  if (!(surface.wind_mps >= 0.0 && surface.wind_mps <= 60.0))
    throw std::invalid_argument(
        fmt::format("sea surface: wind is {} m/s, expected 0 to 60", surface.wind_mps));
  if (!(surface.frequency_hz > 0.0 && std::isfinite(surface.frequency_hz)))
    throw std::invalid_argument(
        fmt::format("sea surface: frequency is {} Hz, expected more than 0", surface.frequency_hz));
  if (!(grazing_rad >= 0.0 && grazing_rad <= pi / 2))
    throw std::invalid_argument(
        fmt::format("sea surface: grazing angle is {} degrees, expected 0 to 90",
                    grazing_rad * degrees_per_rad));
}

/// The grazing angle at which the facets' lobe is 15 dB below its peak. Solves (1 + x)^2 exp(-x /
/// s2) = 10^-1.5 for x, the squared cotangent of the grazing angle.
double facet_edge_rad(double slope2) {
  double x = 0.0;
  for (int step = 0; step < 20; ++step)
    x = slope2 * (1.5 * std::numbers::ln10 + 2.0 * std::log1p(x));
  return std::atan2(1.0, std::sqrt(x));
}

}  // namespace

double bubble_cross_section(const SeaSurface& surface, double grazing_rad) {
  check_surface(surface, grazing_rad);
  const double U = surface.wind_mps;
  const double f = surface.frequency_hz / 1000.0;  // kHz, as in the report
  double bv = std::pow(10.0, -5.2577 + 0.4701 * std::min(U, 11.0)) * std::pow(f / 25.0, 0.85);
  if (U > 11.0) bv *= std::pow(U / 11.0, 3.5);
  const double reradiation = 0.0136 / (0.0255 * std::cbrt(f));
  const double b = bv / std::sin(grazing_rad);
  // The layer's response is (1 + 8 b e^-2b - e^-4b) / 2b: 6 if it is thin, and 1 / 2b if opaque.
  constexpr double opaque = 300.0;
  const double shown = b < opaque ? 8.0 * b * std::exp(-2.0 * b) - std::expm1(-4.0 * b) : 1.0;
  return bv / (4.0 * pi) * reradiation * shown / (2.0 * b);
}

double facet_slope2(const SeaSurface& surface) {
  check_surface(surface, 0.0);
  const double U = surface.wind_mps;
  return U < 1.0 ? 0.0034 : 4.6e-3 * std::log(2.1 * U * U);
}

double bubble_loss_db(const SeaSurface& surface, double grazing_rad) {
  check_surface(surface, grazing_rad);
  const double U = surface.wind_mps;
  const double f = surface.frequency_hz / 1000.0;
  const double wind =
      U >= 6.0 ? std::pow(U, 1.57) : std::pow(6.0, 1.57) * std::exp(1.2 * (U - 6.0));
  return 1.26e-3 / std::sin(grazing_rad) * wind * std::pow(f, 0.85);
}

double facet_cross_section(const SeaSurface& surface, double grazing_rad) {
  check_surface(surface, grazing_rad);
  if (grazing_rad == 0.0) return 0.0;
  const double s2 = facet_slope2(surface);
  const double sine = std::sin(grazing_rad);
  const double cotangent = std::cos(grazing_rad) / sine;
  return std::exp(-4.0 * std::log(sine) - cotangent * cotangent / s2) / (4.0 * pi * s2);
}

double ripple_cross_section(const SeaSurface& surface, double grazing_rad) {
  check_surface(surface, grazing_rad);
  if (grazing_rad * degrees_per_rad > 85.0) return 0.0;
  return 1.3e-5 * std::pow(surface.wind_mps, 2) * std::pow(std::tan(grazing_rad), 4);
}

double surface_cross_section(const SeaSurface& surface, double grazing_rad) {
  const double edge_rad = facet_edge_rad(facet_slope2(surface));
  const double share = 1.0 / (1.0 + std::exp(0.524 * degrees_per_rad * (edge_rad - grazing_rad)));
  const double interface = share * facet_cross_section(surface, grazing_rad) +
                           (1.0 - share) * ripple_cross_section(surface, grazing_rad);
  return interface * from_db(-bubble_loss_db(surface, grazing_rad)) +
         bubble_cross_section(surface, grazing_rad);
}

}  // namespace ensonify::scatter
