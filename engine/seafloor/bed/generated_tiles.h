#pragma once

#include <cstdint>

#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/bed/mean_plane.h>
#include <ensonify/engine/seafloor/bed/ripples.h>
#include <ensonify/refine/height_tiles.h>

namespace ensonify::engine {

/// A generated bed that is too large for one transform: a plane with relief and ripples as
/// TiledField makes them. Heights are rounded to floats. Only the size of the grid is used. The
/// fields are prepared at the first call. Throws std::invalid_argument as add_fractal() and
/// add_ripples().
refine::HeightTiles::Heights generated_tiles(const Heightfield& grid, const MeanPlane& plane,
                                             const FractalRelief& fractal,
                                             const RippleRelief& ripples, std::uint64_t seed);

}  // namespace ensonify::engine
