#pragma once

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// How strongly a bed reflects about the specular direction: the scattering cross-section per unit
/// area and unit solid angle (linear) for sound that arrives at one grazing angle and continues
/// forwards at another, in a vertical plane that is turned by an azimuth.
///
/// Kirchhoff's integral depends on the change of the wave vector alone, q = k_out - k_in, with the
/// parts q_z = k (sin in + sin out) and q_h = k |cos in - cos out exp(i turned)|. So TR 9407's form
/// of it for backscatter (kirchhoff.h), where |q| = 2 k, serves at the wavenumber |q| / 2 and the
/// grazing angle of q, atan(q_z / q_h); and with |R|^2 at asin(|q| / 2 k), at which the facet that
/// reflects is met, for |R|^2 at 90 degrees. Within one plane these are k sin((in + out) / 2), 90
/// degrees - |in - out| / 2 and (in + out) / 2. The relief's power law has no largest scale, so
/// that this lobe holds the coherent reflection, too. 0 for a smooth bed, whose reflection is a
/// mirror's and no cross-section.
double forward_lobe(const Sediment& sediment, double k_per_cm, double grazing_in_rad,
                    double grazing_out_rad, double turned_rad = 0.0);

}  // namespace ensonify::scatter
