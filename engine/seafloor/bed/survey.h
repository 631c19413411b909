#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ensonify/engine/seafloor/bed/geographic.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>
#include <ensonify/refine/height_tiles.h>

namespace ensonify::engine {

/// How far the heights of a survey scatter about those of its file: each cell's by this share of
/// its uncertainty, normally distributed. A cell without uncertainty does not scatter.
struct SurveyScatter {
  double of_uncertainty = 0.0;  ///< 0: heights are those of the file
  std::uint64_t seed = 0;
};

/// The names of SurveyFile::cell_m in messages: the key of a scene, and the option of a command
/// without a scene.
inline constexpr std::string_view cell_key = "seafloor.survey_cell_m (--survey-cell-m)";

/// The file of a survey.
struct SurveyFile {
  std::filesystem::path path;
  double cell_m = 0.0;  ///< only for an .npy file or scattered soundings; otherwise 0
  SurveyFile(std::filesystem::path file, double cell = 0.0) : path(std::move(file)), cell_m(cell) {}
};

/// Reads the heights (up) of a survey grid: GeoTIFF, BAG, ESRI ASCII, netCDF, .npy (vrt_of_npy()),
/// scattered soundings (Soundings), or a VRT mosaic of GeoTIFF, BAG, ESRI ASCII and netCDF files on
/// this machine. A BAG of variable resolution is read on a grid of its finest cells, with linear
/// interpolation between coarser ones. Of several bands it takes the first that is
/// named elevation, depth, height or bathymetry (and not its uncertainty, error or deviation), or
/// else the first. NODATA (in a text grid -9999 if none is declared), non-finite heights and those
/// under a mask become holes. Grid points are the centres of the
/// raster's pixels. The world origin is the grid's middle at the height of the water level, which
/// is given in the survey's vertical datum. Throws refine::MeshError for a file that cannot be
/// opened, is truncated, promises more cells than its size can hold, is rotated, is in degrees or
/// in another unit than metres, has heights of 9999 m that no NODATA value explains, or has no
/// whole cell; and, if heights scatter, for one without a band that is named uncertainty, deviation
/// or error; and for a file beside it that FilesBeside refuses. GDAL's metadata in an .aux.xml file
/// beside it count as its own: NODATA, reference system, place, scale, offset, unit. (Those beside
/// a mosaic's sources do not: the mosaic has them.)
/// `stop_check` is called for each row; what it throws ends the reading.
Heightfield read_survey(const SurveyFile& file, double water_level_m,
                        const SurveyScatter& scatter = {},
                        const std::function<void()>& stop_check = {});

/// The reference system, as WKT, of a world with this middle: transverse Mercator about it on WGS
/// 84, which agrees with tangent_place to 3 mm at 7 km.
std::string reference_about(const GeographicPlace& middle, const Eigen::Vector3d& world_origin);

/// The heights of such a file by windows. The file is opened at the first window; faults of the
/// heights are thrown when they are read.
refine::HeightTiles::Heights survey_tiles(const SurveyFile& file, double water_level_m,
                                          const SurveyScatter& scatter = {});

/// Samples of a survey that is too large to be read: the heights of 64 parts of 32 x 32 points,
/// spread over it.
struct SurveySample {
  double mean_m = 0.0;
  double lowest_m = std::numeric_limits<double>::infinity();
  double highest_m = -std::numeric_limits<double>::infinity();
  std::vector<Heightfield> parts;  ///< with the heights themselves
};
/// Throws as read_survey(), also if none of the places has heights.
SurveySample sample_survey(const SurveyFile& file, double water_level_m);

/// The files that belong to a file of a scene and are read with it, sorted: the sources of a
/// mosaic, and those beside a raster (FilesBeside::read()). All lie in the file's folder or below
/// it. Empty for a file that is no raster or is missing. Throws refine::MeshError for a mosaic that
/// read_survey() refuses because of its sources, and for a file beside a raster that FilesBeside
/// refuses.
std::vector<std::filesystem::path> files_behind(const std::filesystem::path& file);

/// The grid without heights, read from the file's header. Throws what read_survey() would throw for
/// that header.
Heightfield read_survey_header(const SurveyFile& file);

}  // namespace ensonify::engine
