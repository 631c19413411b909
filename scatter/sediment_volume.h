#pragma once

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// What inhomogeneities below a flat interface send back; linear: TR 9407 eq. 66. Without loss it
/// is the limit of little loss.
double flat_sediment_volume(const Sediment& sediment, double grazing_rad);

/// The same below large-scale slopes, averaged and shadowed as composite roughness; linear: TR 9407
/// eq. 65. The slope is s, or what the mesh leaves of it.
double sediment_volume(const Sediment& sediment, double grazing_rad, double slope);

}  // namespace ensonify::scatter
