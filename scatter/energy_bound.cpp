#include <ensonify/scatter/energy_bound.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <ensonify/scatter/angle.h>
#include <ensonify/scatter/decibel.h>

namespace ensonify::scatter {
namespace {

using std::numbers::pi;

constexpr double lowest_rad = 5.0 * degree, end_of_diffuse_rad = 60.0 * degree;

/// The part of the arriving energy that returns if sound arrives vertically, by Simpson's rule. The
/// angle from vertical is pi/2 u^3 with even steps of u, so steps are fine in a lobe near vertical.
double returned_at_vertical(const Backscatter& material) {
  constexpr int panels = 1000;
  const double lambert_mu =
      material.cross_section(end_of_diffuse_rad) / std::pow(std::sin(end_of_diffuse_rad), 2.0);
  double root_of_diffuse = 0.0, lobe = 0.0;
  for (int i = 1; i <= panels; ++i) {
    const double u = double(i) / panels, off_vertical = 0.5 * pi * u * u * u;
    const double weight = (i == panels  ? 1.0
                           : i % 2 == 1 ? 4.0
                                        : 2.0) /
                          (3.0 * panels) * 2.0 * pi * std::sin(off_vertical) * 1.5 * pi * u * u;
    const double cosine = std::cos(off_vertical);
    const double sigma = material.cross_section(0.5 * pi - off_vertical);
    const double diffuse = 0.5 * pi - off_vertical > end_of_diffuse_rad
                               ? std::min(sigma, lambert_mu * cosine * cosine)
                               : sigma;
    root_of_diffuse += weight * std::sqrt(diffuse);
    lobe += weight * (sigma - diffuse) * cosine;
  }
  const double diffuse = std::min(material.cross_section(0.5 * pi), lambert_mu);
  return std::sqrt(diffuse) * root_of_diffuse + 4.0 * lobe;
}

}  // namespace

double diffuse_bound(double grazing_rad) {
  const double sine = std::sin(grazing_rad);
  return sine * sine / pi;
}

std::optional<EnergyExcess> energy_excess(const Backscatter& material) {
  constexpr double rounding = 1e-6;
  double largest = 1.0 + rounding, at_rad = 0.0;
  const auto compare = [&](double ratio, double grazing_rad) {
    if (!(ratio > largest)) return;
    largest = ratio;
    at_rad = grazing_rad;
  };
  for (int half_degrees = 0; half_degrees <= 110; ++half_degrees) {
    const double grazing_rad = lowest_rad + 0.5 * half_degrees * degree;
    compare(material.cross_section(grazing_rad) / diffuse_bound(grazing_rad), grazing_rad);
  }
  compare(returned_at_vertical(material), 0.5 * pi);
  if (at_rad == 0.0) return std::nullopt;
  return EnergyExcess{at_rad, to_db(largest)};
}

std::string EnergyExcess::text() const {
  return fmt::format(
      "{:.3g} degrees it is {:.1f} dB stronger than any opaque surface can be, by the energy that "
      "arrives",
      grazing_rad / degree, excess_db);
}

}  // namespace ensonify::scatter
