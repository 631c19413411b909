#pragma once

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// The critical angle, in degrees: below it sound is reflected totally. 2.5613 for a bed in which
/// sound is not faster than in the water: TR 9407 eq. 54.
double critical_angle_deg(const Sediment& sediment);

/// The backscattering cross-section (linear) of relief that is steep everywhere: an empirical
/// formula that was fitted to gravel and rock, TR 9407 eqs 53-56. `slope` is the whole rms slope s.
double large_roughness(const Sediment& sediment, double grazing_rad, double slope);

}  // namespace ensonify::scatter
