#pragma once

#include <filesystem>
#include <string>

#include <ensonify/engine/seafloor/bed/geographic.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// Reads the first band (elevation, up) of a survey grid: GeoTIFF, BAG, ESRI ASCII, netCDF. NODATA
/// and non-finite heights become holes. Grid points are the centres of the raster's pixels. The
/// world origin is the grid's middle at the height of the water level, which is given in the
/// survey's vertical datum. Throws refine::MeshError for a file that cannot be opened, is
/// truncated, promises more cells than its size can hold, is rotated, is in degrees or in feet, or
/// has no whole cell. Neither reads nor writes .aux.xml files.
Heightfield read_survey(const std::filesystem::path& file, double water_level_m);

/// The coordinate reference system of such a file as WKT; empty if the file names none. Throws
/// refine::MeshError for a file that cannot be opened.
std::string survey_reference(const std::filesystem::path& file);

/// The reference system, as WKT, of a world with this middle: transverse Mercator about it on WGS
/// 84, which agrees with tangent_place to 3 mm at 7 km.
std::string reference_about(const GeographicPlace& middle, const Eigen::Vector3d& world_origin);

/// The grid without heights, read from the file's header. Throws what read_survey() would throw for
/// that header.
Heightfield read_survey_header(const std::filesystem::path& file);

}  // namespace ensonify::engine
