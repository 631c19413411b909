#pragma once

#include <filesystem>

#include <ensonify/engine/seafloor/heightfield.h>

namespace ensonify::engine {

/// Reads the first band (elevation, up) of a survey grid: GeoTIFF, BAG, ESRI ASCII, netCDF. NODATA
/// and non-finite heights become holes. Grid points are the centres of the raster's pixels. The
/// world origin is the grid's middle, its height the water level in the survey's own heights.
/// Throws refine::MeshError for a file that cannot be opened, is truncated, promises more cells
/// than its size can hold, is turned, in degrees or in feet, or has no whole cell. Neither heeds
/// nor writes .aux.xml files.
Heightfield read_survey(const std::filesystem::path& file, double water_level_m);

}  // namespace ensonify::engine
