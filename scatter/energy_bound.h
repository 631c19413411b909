#pragma once

#include <optional>
#include <string>

#include <ensonify/scatter/backscatter.h>

namespace ensonify::scatter {

/// sin^2(grazing) / pi: the most that an opaque surface can scatter back diffusely.
double diffuse_bound(double grazing_rad);

/// Where a material exceeds what an opaque surface can return, and by how much.
struct EnergyExcess {
  double grazing_rad = 0.0;
  double excess_db = 0.0;

  /// Continues a warning after "at": "5 degrees it is 3.0 dB stronger than any opaque surface can
  /// be, by the energy that arrives"
  std::string text() const;
};

/// The largest excess from 5 to 90 degrees; nullopt if the material returns no more than arrives.
/// (Below 5 degrees no model states an accuracy.)
///
/// 1 m^2 at the grazing angle i receives sin(i) and scatters the bistatic cross-section sigma(i, s)
/// into each direction s, so it returns the part E(i) = integral of sigma(i, s) dOmega(s) / sin(i)
/// over the hemisphere, at most 1. Only sigma(i) = sigma(i, i) is known, so these assumptions are
/// made:
///
/// - Diffuse scattering is reciprocal and separable, and the same in all azimuths:
///   sigma(i, s) = sqrt(sigma(i) sigma(s)). Then E(i) = sqrt(sigma(i)) / sin(i) * integral of
///   sqrt(sigma) dOmega, which is pi mu for Lambert's law. E is at most 1 everywhere if sigma is
///   nowhere above sin^2 / pi, and this is demanded at each angle up to 60 degrees: one may not
///   return more because others return less, as a reflector towards the sonar does.
/// - Above 60 degrees, what stands above Lambert's law through the strength at 60 degrees is a lobe
///   of facets, which reflect. At vertical incidence they return 4 times the integral of sigma
///   cos(t) dOmega over the lobe, t being the angle from vertical: exactly so for Hagfors's facets
///   (solid_target.h), whatever their slopes. This and the diffuse part together are at most 1.
std::optional<EnergyExcess> energy_excess(const Backscatter& material);

}  // namespace ensonify::scatter
