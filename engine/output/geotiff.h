#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// A heightfield as a GeoTIFF that read_survey() reads back unchanged: float heights in world
/// coordinates at the pixels' centres, north up; holes are NaN, which is the NODATA value.
/// `reference` is the coordinate reference system of the world coordinates as WKT (empty: none).
/// Throws std::runtime_error if there is not enough memory, or if GDAL cannot write the reference
/// system (for example, without PROJ's database).
std::vector<std::byte> encode_geotiff(const Heightfield& field, const std::string& reference = {});

}  // namespace ensonify::engine
