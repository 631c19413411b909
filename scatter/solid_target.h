#pragma once

#include <string_view>
#include <vector>

#include <ensonify/scatter/backscatter.h>

namespace ensonify::scatter {

/// What the surface of a solid does with sound: it sends one part of the energy everywhere, and
/// reflects another from facets that lean a little from the surface.
struct Solid {
  double diffuse_db = -15.0;     ///< 10 log10 mu, at most -4.97
  double specular = 0.3;         ///< reflected part of the arriving energy, 0 to 1
  double lobe_width_rad = 0.09;  ///< rms lean of the facets: the lobe's half width at 1/e
};

struct NamedSolid {
  std::string_view name;
  Solid solid;
};

/// Typical values, of the impedances' order and nobody's measurement: steel, aluminium, concrete,
/// stone, wood, glass fibre, rubber.
std::vector<NamedSolid> named_solids();

/// One of them. Throws std::invalid_argument with all names for another.
Solid solid_named(std::string_view name);

/// mu sin^2(grazing) + specular sec^4(g) exp(-tan^2(g) / s^2) / (4 pi s^2), where g is the angle
/// from the normal and s the tangent of the lobe's width; no frequency.
///
/// The lobe is the high-frequency Kirchhoff integral of a surface with Gaussian slopes of total
/// variance s^2 (Hagfors, J. Geophys. Res. 69, 3779 (1964)). Its integral over all directions is
/// the part `specular` of what arrives at normal incidence, and over a sphere of radius a it is
/// a^2/4 of it, whatever s is while small. A flat facet of side L has the lobe of its diffraction
/// with s = lambda / (2 sqrt(pi) L), which makes a plate's (A/lambda)^2 and a cylinder's a L^2 / (2
/// lambda).
class SolidTarget final : public Backscatter {
 public:
  /// Throws std::invalid_argument, naming the range, for a value outside it and where pi mu +
  /// specular exceeds 1: more energy than arrives.
  explicit SolidTarget(const Solid& solid);
  double cross_section(double grazing_rad) const override;

 private:
  double mu_;
  double specular_;
  double s2_;
};

}  // namespace ensonify::scatter
