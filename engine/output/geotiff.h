#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// A heightfield as a GeoTIFF that read_survey gives back: float heights in the survey's own terms
/// (world origin and all) at the pixels' centres, north up, holes as NaN NODATA, the coordinate
/// reference system of that world as WKT (empty: none). Throws std::runtime_error if memory does
/// not hold it, or a GeoTIFF the reference system.
std::vector<std::byte> encode_geotiff(const Heightfield& field, const std::string& reference = {});

}  // namespace ensonify::engine
