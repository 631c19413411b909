#pragma once

#include <cstdint>

#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// A directional Gaussian field. Its spectrum is the fractal filter with the maximum moved to +-k0
/// along the direction across the crests, with k0 = 2 pi / wavelength.
struct RippleRelief {
  double rms_height_m = 0.0;  ///< standard deviation of the height; 0: no ripples
  double wavelength_m = 1.0;
  double across_crests_rad = 0.0;  ///< heading of the direction across the crests, from north
  double relative_width = 0.1;     ///< spectral half width k_w / k0
  double hurst = 2.0;  ///< how fast the spectrum falls from its maximum; smooth crests above 1
};

/// Adds ripples of amplitude (|k - k0|^2 + k_w^2)^(-(H+1)/2) + (|k + k0|^2 + k_w^2)^(-(H+1)/2) to a
/// field, scaled to the rms height, with a mean of zero. Throws std::invalid_argument for a
/// non-positive wavelength, width or H, a negative height, or cells longer than a quarter of the
/// wavelength.
void add_ripples(Heightfield& field, const RippleRelief& relief, std::uint64_t seed,
                 const WorkControl& control = {});

}  // namespace ensonify::engine
