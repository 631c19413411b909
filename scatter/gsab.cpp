#include <ensonify/scatter/gsab.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

namespace ensonify::scatter {
namespace {

double lobe(double level, double width_rad, double incidence_rad) {
  if (level == 0.0) return 0.0;
  const double x = incidence_rad / width_rad;
  return level * std::exp(-0.5 * x * x);
}

}  // namespace

GsabBottom::GsabBottom(const Gsab& gsab) : gsab_(gsab) {
  const auto require = [](bool holds, const char* name, double value, const char* expected) {
    if (!holds)
      throw std::invalid_argument(
          fmt::format("gsab: {} is {}, expected {}", name, value, expected));
  };
  const auto require_lobe = [&](const char* name, double level, const char* width_name,
                                double width_rad) {
    require(level >= 0.0 && std::isfinite(level), name, level, "0 or more");
    require(level == 0.0 || (width_rad > 0.0 && width_rad <= std::numbers::pi / 2.0), width_name,
            width_rad, "more than 0 and at most pi/2");
  };
  require_lobe("specular", gsab.specular, "specular_width_rad", gsab.specular_width_rad);
  require_lobe("transitional", gsab.transitional, "transitional_width_rad",
               gsab.transitional_width_rad);
  require(gsab.lambert >= 0.0 && std::isfinite(gsab.lambert), "lambert", gsab.lambert, "0 or more");
  require(gsab.lambert_exponent >= 0.0 && gsab.lambert_exponent <= 20.0, "lambert_exponent",
          gsab.lambert_exponent, "0 to 20");
}

double GsabBottom::cross_section(double grazing_rad) const {
  const double incidence_rad = std::numbers::pi / 2.0 - grazing_rad;
  return lobe(gsab_.specular, gsab_.specular_width_rad, incidence_rad) +
         gsab_.lambert * std::pow(std::sin(grazing_rad), gsab_.lambert_exponent) +
         lobe(gsab_.transitional, gsab_.transitional_width_rad, incidence_rad);
}

}  // namespace ensonify::scatter
