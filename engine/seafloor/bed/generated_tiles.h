#pragma once

#include <cstdint>

#include <ensonify/engine/seafloor/bed/fractal.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/engine/seafloor/bed/mean_plane.h>
#include <ensonify/engine/seafloor/bed/ripples.h>
#include <ensonify/refine/height_tiles.h>

namespace ensonify::engine {

/// The heights of a generated bed that is too large for one transform: a plane with relief and
/// ripples from TiledField. Heights are rounded to floats. Only the size of `grid` is used. The
/// first call of the returned function prepares the fields. Throws std::invalid_argument as
/// add_fractal() and add_ripples().
refine::HeightTiles::Heights generated_tiles(const Heightfield& grid, const MeanPlane& plane,
                                             const FractalRelief& fractal,
                                             const RippleRelief& ripples, std::uint64_t seed);

}  // namespace ensonify::engine
