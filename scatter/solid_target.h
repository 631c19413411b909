#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <ensonify/scatter/backscatter.h>

namespace ensonify::scatter {

/// How the surface of a solid returns sound. It scatters one part of the energy in all directions.
/// Another part is reflected from facets that are slightly inclined to the surface.
struct Solid {
  double diffuse_db = -15.0;  ///< 10 log10 mu, at most -4.97
  double specular = 0.3;      ///< reflected part of the arriving energy, 0 to 1
  /// The half width of the lobe of the facets, at 1/e of its peak: the rms inclination of the
  /// surface's own roughness. 0: the surface is smooth.
  double lobe_width_rad = 0.09;

  /// The part of the arriving energy that the surface reflects like a mirror, without scattering:
  /// specular exp(-(2 k h)^2) (Eckart, J. Acoust. Soc. Am. 25, 566 (1953)). The rms height h
  /// follows from the inclination s and the correlation length. The correlation length is taken as
  /// one wavelength, the shortest for which Kirchhoff's theory holds. Then h = s lambda / 2, and (2
  /// k h)^2 = (2 pi s)^2.
  double smooth_specular() const;
  /// The solid without this part: `specular` is then the part that its rough surface scatters.
  Solid rough() const;
};

struct NamedSolid {
  std::string_view name;
  Solid solid;
};

/// Solids with typical values, which are not measured, ordered by impedance. Clean metal reflects
/// like a mirror and scatters little; rust and marine growth make it rough. Clean rubber reflects
/// almost nothing; the echo of an old tyre comes from its marine growth.
std::vector<NamedSolid> named_solids();

/// The names of all solids, with commas between them.
std::string solid_names();

/// The solid with this name. For an unknown name throws std::invalid_argument with all names.
Solid solid_named(std::string_view name);

/// mu sin^2(grazing) + specular sec^4(g) exp(-tan^2(g) / s^2) / (4 pi s^2), where g is the angle
/// from the normal and s the tangent of the lobe's width. It does not depend on the frequency.
///
/// The lobe is the high-frequency Kirchhoff integral of a surface with Gaussian slopes of total
/// variance s^2 (Hagfors, J. Geophys. Res. 69, 3779 (1964)). Its integral over all directions is
/// the part `specular` of the energy that arrives at normal incidence. Its integral over a sphere
/// of radius a is a^2/4 times this part, for any small s. A flat facet of side L has the lobe of
/// its diffraction with s = lambda / (2 sqrt(pi) L). This gives (A/lambda)^2 for a plate of area A,
/// and a L^2 / (2 lambda) for a cylinder of radius a and length L. A lobe without width cannot be
/// computed this way and is left out.
class SolidTarget final : public Backscatter {
 public:
  /// Throws std::invalid_argument, with the expected range, for a value outside its range, and if
  /// pi mu + specular exceeds 1 (more energy than arrives).
  explicit SolidTarget(const Solid& solid);
  double cross_section(double grazing_rad) const override;

 private:
  double mu_;
  double specular_;
  double s2_;
};

}  // namespace ensonify::scatter
