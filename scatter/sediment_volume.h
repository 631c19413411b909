#pragma once

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// The backscattering cross-section (linear) of inhomogeneities below a flat interface: TR 9407 eq.
/// 66. If the loss is 0, returns the limit of small loss.
double flat_sediment_volume(const Sediment& given, double grazing_rad);

/// The same cross-section below large-scale slopes, averaged over slopes and shadowed like
/// composite roughness: TR 9407 eq. 65. `slope` is the rms slope s, or the part of s that the mesh
/// does not show.
double sediment_volume(const Sediment& sediment, double grazing_rad, double slope);

}  // namespace ensonify::scatter
