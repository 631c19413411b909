#pragma once

#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/bed/ripples.h>
#include <ensonify/engine/seafloor/bed/spectral.h>

namespace ensonify::engine {

/// The spectrum of what add_fractal() adds to a grid. Only the size of the grid and of its cells is
/// used. Throws what add_fractal() throws.
SpectralField fractal_field(const Heightfield& grid, const FractalRelief& relief);
/// The same of add_ripples().
SpectralField ripple_field(const Heightfield& grid, const RippleRelief& relief);

}  // namespace ensonify::engine
