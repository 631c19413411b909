#pragma once

#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/bed/ripples.h>
#include <ensonify/engine/seafloor/bed/spectral.h>

namespace ensonify::engine {

/// The spectrum of the relief that add_fractal() adds to a grid. Only the size of the grid and of
/// its cells is used. Throws as add_fractal().
SpectralField fractal_field(const Heightfield& grid, const FractalRelief& relief);
/// The spectrum of the relief that add_ripples() adds to a grid. Throws as add_ripples().
SpectralField ripple_field(const Heightfield& grid, const RippleRelief& relief);

}  // namespace ensonify::engine
