#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// A heightfield as a GeoTIFF that read_survey() reads back unchanged: float heights in world
/// coordinates at the pixels' centres, north up, holes as NaN NODATA. `reference` is the world's
/// coordinate reference system as WKT (empty: none). Throws std::runtime_error if memory is too
/// small, or if the file would lack the reference system, as without PROJ's database.
std::vector<std::byte> encode_geotiff(const Heightfield& field, const std::string& reference = {});

}  // namespace ensonify::engine
