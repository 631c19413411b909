#pragma once

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// The critical angle, below which sound is reflected totally; 2.5613 degrees for a bed that is not
/// faster than the water: TR 9407 eq. 54.
double critical_angle_deg(const Sediment& sediment);

/// The empirical formula for relief that is steep everywhere, fitted to gravel and rock; linear: TR
/// 9407 eqs 53-56. `slope` is the whole s.
double large_roughness(const Sediment& sediment, double grazing_rad, double slope);

}  // namespace ensonify::scatter
