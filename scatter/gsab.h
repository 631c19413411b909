#pragma once

#include <ensonify/scatter/backscatter.h>

namespace ensonify::scatter {

/// The parameters of the generic model GSAB. Levels are linear cross-sections. A lobe with the
/// level 0 does not exist, whatever its width.
struct Gsab {
  double specular = 0.0;                ///< A, level of the specular lobe at vertical
  double specular_width_rad = 0.0;      ///< B, its standard deviation
  double lambert = 0.0;                 ///< C, level of the Lambert-like part at vertical
  double lambert_exponent = 2.0;        ///< D; 2 is Lambert's law
  double transitional = 0.0;            ///< E, level of the transitional lobe at vertical
  double transitional_width_rad = 0.0;  ///< F, its standard deviation
};

/// Generic Seafloor Acoustic Backscatter: sigma = A exp(-t^2 / (2 B^2)) + C cos^D(t) + E exp(-t^2 /
/// (2 F^2)), where t is the angle of incidence, from vertical. Lamarche, Lurton, Verdier and
/// Augustin, Cont. Shelf Res. 31, S93 (2011), after Lurton, An Introduction to Underwater Acoustics
/// (2010). It is not a theory, but a curve that is fitted to measurements.
class GsabBottom final : public Backscatter {
 public:
  /// Throws std::invalid_argument, with the expected range, if a level is negative, the exponent is
  /// not in 0 to 20, or a lobe's level is not 0 and its width is not above 0 and at most pi/2.
  explicit GsabBottom(const Gsab& gsab);
  double cross_section(double grazing_rad) const override;

 private:
  Gsab gsab_;
};

}  // namespace ensonify::scatter
