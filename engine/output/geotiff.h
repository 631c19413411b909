#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/engine/seafloor/heightfield.h>

namespace ensonify::engine {

/// A heightfield as a GeoTIFF that read_survey gives back: float heights in the survey's own terms
/// (world origin and all), north up, holes as NaN NODATA, no coordinate reference system. Throws
/// std::runtime_error if memory does not hold it.
std::vector<std::byte> encode_geotiff(const Heightfield& field);

}  // namespace ensonify::engine
