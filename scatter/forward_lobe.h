#pragma once

#include <ensonify/scatter/sediment.h>

namespace ensonify::scatter {

/// How strongly a bed scatters sound near the specular direction: the scattering cross-section
/// (linear) per unit area and unit solid angle. The sound arrives at one grazing angle and
/// continues forwards at another, in a vertical plane that is turned by the azimuth turned_rad.
///
/// Kirchhoff's integral depends only on q = k_out - k_in, the change of the wave vector, whose
/// parts are q_z = k (sin in + sin out) and q_h = k |cos in - cos out exp(i turned)|. TR 9407 has
/// this integral for backscatter (kirchhoff.h), where |q| = 2 k. Here the wavenumber is |q| / 2 and
/// the grazing angle is the one of q, atan(q_z / q_h). |R|^2 is not taken at 90 degrees but at
/// asin(|q| / 2 k), the grazing angle on the facet that reflects. Without a turn, these three are k
/// sin((in + out) / 2), 90 degrees - |in - out| / 2 and (in + out) / 2. The relief's power law has
/// no largest scale, so this lobe includes the coherent reflection. Returns 0 for a smooth bed: it
/// reflects like a mirror and has no cross-section.
double forward_lobe(const Sediment& sediment, double k_per_cm, double grazing_in_rad,
                    double grazing_out_rad, double turned_rad = 0.0);

}  // namespace ensonify::scatter
