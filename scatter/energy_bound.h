#pragma once

#include <optional>
#include <string>

#include <ensonify/scatter/backscatter.h>

namespace ensonify::scatter {

/// sin^2(grazing) / pi: the most that an opaque surface can scatter back diffusely.
double diffuse_bound(double grazing_rad);

/// The grazing angle at which a material returns more than an opaque surface can, and by how much.
struct EnergyExcess {
  double grazing_rad = 0.0;
  double excess_db = 0.0;

  /// Continues a warning after "at": "5 degrees it is 3.0 dB stronger than any opaque surface can
  /// be, by the energy that arrives"
  std::string text() const;
};

/// The largest excess from 5 to 90 degrees; nullopt if the material returns no more energy than
/// arrives. Angles below 5 degrees are left out, because no model states an accuracy there.
///
/// A surface of 1 m^2 receives sin(i) of the sound that arrives at the grazing angle i. It scatters
/// the bistatic cross-section sigma(i, s) into each direction s. So it returns the part E(i) =
/// integral of sigma(i, s) dOmega(s) / sin(i) over the hemisphere, and this part is at most 1. Only
/// the backscatter sigma(i) = sigma(i, i) is known, so two assumptions are made:
///
/// - Diffuse scattering is reciprocal and separable, and the same in all azimuths: sigma(i, s) =
///   sqrt(sigma(i) sigma(s)). Then E(i) = sqrt(sigma(i)) / sin(i) * integral of sqrt(sigma) dOmega,
///   which is pi mu for Lambert's law. If sigma is nowhere above sin^2 / pi, then E is at most 1
///   everywhere. This limit is applied at each angle up to 60 degrees: an angle may not return
///   more because other angles return less. (A reflector that is turned towards the sonar would.)
/// - Above 60 degrees, the part of sigma that exceeds Lambert's law through the strength at 60
///   degrees is a lobe of facets, which reflect. At vertical incidence the facets return 4 times
///   the integral of sigma cos(t) dOmega over the lobe, where t is the angle from vertical. This is
///   exact for Hagfors's facets (solid_target.h), whatever their slopes are. The energies of lobe
///   and diffuse part together are at most 1.
std::optional<EnergyExcess> energy_excess(const Backscatter& material);

}  // namespace ensonify::scatter
