#pragma once

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// Backscatter of inhomogeneities below a flat interface; linear: TR 9407 eq. 66. For zero loss
/// returns the limit of small loss.
double flat_sediment_volume(const Sediment& given, double grazing_rad);

/// The same below large-scale slopes, averaged and shadowed like composite roughness; linear: TR
/// 9407 eq. 65. `slope` is s, or the part of it that the mesh does not show.
double sediment_volume(const Sediment& sediment, double grazing_rad, double slope);

}  // namespace ensonify::scatter
