#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// A heightfield as a GeoTIFF from which read_survey makes the same: float heights in the survey's
/// coordinates (with its world origin) at the pixels' centres, north up, holes as NaN NODATA, the
/// coordinate reference system of that world as WKT (empty: none). Throws std::runtime_error if
/// there is not enough memory, or if GeoTIFF cannot hold the reference system.
std::vector<std::byte> encode_geotiff(const Heightfield& field, const std::string& reference = {});

}  // namespace ensonify::engine
