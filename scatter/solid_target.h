#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <ensonify/scatter/backscatter.h>

namespace ensonify::scatter {

/// How the surface of a solid returns sound: it scatters one part of the energy in all directions,
/// and reflects another from facets that are slightly inclined to the surface.
struct Solid {
  double diffuse_db = -15.0;  ///< 10 log10 mu, at most -4.97
  double specular = 0.3;      ///< reflected part of the arriving energy, 0 to 1
  /// The lobe's half width at 1/e, by the rms inclination of the surface's own roughness; 0:
  /// smooth.
  double lobe_width_rad = 0.09;

  /// The part of the arriving energy that it reflects as a smooth surface would, without
  /// scattering: specular exp(-(2 k h)^2) (Eckart, J. Acoust. Soc. Am. 25, 566 (1953)). The height
  /// h belongs to roughness of that inclination s and of the shortest correlation length for which
  /// Kirchhoff's theory holds, a wavelength: h = s lambda / 2, so that (2 k h)^2 = (2 pi s)^2.
  double smooth_specular() const;
  /// The solid without that part: its rough surface scatters the rest of the specular part.
  Solid rough() const;
};

struct NamedSolid {
  std::string_view name;
  Solid solid;
};

/// Typical values, not measured, ordered by impedance. Clean metal reflects like a mirror and
/// scatters little; rust and growth make it rough. Clean rubber reflects almost nothing; the echo
/// of an old tyre comes from its growth.
std::vector<NamedSolid> named_solids();

/// Their names, with commas between them.
std::string solid_names();

/// The solid of that name. Throws std::invalid_argument with all names for an unknown one.
Solid solid_named(std::string_view name);

/// mu sin^2(grazing) + specular sec^4(g) exp(-tan^2(g) / s^2) / (4 pi s^2), where g is the angle
/// from the normal and s the tangent of the lobe's width; independent of frequency.
///
/// The lobe is the high-frequency Kirchhoff integral of a surface with Gaussian slopes of total
/// variance s^2 (Hagfors, J. Geophys. Res. 69, 3779 (1964)). Its integral over all directions is
/// the part `specular` of the energy that arrives at normal incidence, and over a sphere of radius
/// a it is a^2/4 times that part, for any small s. A flat facet of side L has the lobe of its
/// diffraction with s = lambda / (2 sqrt(pi) L), which gives a plate's (A/lambda)^2 and a
/// cylinder's a L^2 / (2 lambda). A lobe without width has no place here, and is left out.
class SolidTarget final : public Backscatter {
 public:
  /// Throws std::invalid_argument, with the range, for a value outside it and if pi mu + specular
  /// exceeds 1 (more energy than arrives).
  explicit SolidTarget(const Solid& solid);
  double cross_section(double grazing_rad) const override;

 private:
  double mu_;
  double specular_;
  double s2_;
};

}  // namespace ensonify::scatter
