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

/// Scatter of a survey's heights about the heights of the file. The scatter of a cell is normally
/// distributed; its standard deviation is this share of the cell's uncertainty. A cell without
/// uncertainty does not scatter.
struct SurveyScatter {
  double of_uncertainty = 0.0;  ///< 0: the heights do not scatter
  std::uint64_t seed = 0;
};

/// SurveyFile::cell_m in messages: the key of a scene, and the option of commands without one.
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
/// interpolation between the points of coarser refinements. If there are several bands, the heights
/// are the first band that is named elevation, depth, height or bathymetry (and not uncertainty,
/// error or deviation), or else the first band. Holes are NODATA (in a text grid -9999 if none is
/// declared), non-finite heights, and heights under a mask. Grid points are the centres of the
/// raster's pixels. The world origin is the grid's middle at the height of the water level, which
/// is given in the survey's vertical datum. GDAL's metadata in an .aux.xml file beside the file
/// belong to the file: NODATA, reference system, place, scale, offset, unit. (Such files beside the
/// sources of a mosaic are not used, because the mosaic has these data.) `stop_check` is called for
/// each row; it may throw to end the reading. Throws refine::MeshError for a file that cannot be
/// opened, is truncated, promises more cells than its size can hold, is rotated, is in degrees or
/// in another unit than metres, has heights of 9999 m that no NODATA value explains, or has no
/// whole cell; if heights scatter, for a file without a band that is named uncertainty, deviation,
/// std or error; and for a file beside it that FilesBeside refuses.
Heightfield read_survey(const SurveyFile& file, double water_level_m,
                        const SurveyScatter& scatter = {},
                        const std::function<void()>& stop_check = {});

/// The reference system, as WKT, of world coordinates about a place: transverse Mercator about
/// `middle` on WGS 84, in which `middle` has the coordinates `world_origin`. It agrees with
/// tangent_place() to 3 mm at 7 km.
std::string reference_about(const GeographicPlace& middle, const Eigen::Vector3d& world_origin);

/// The heights of the file of a survey, by windows. The file is opened when the first window is
/// read; faults of heights are thrown when the heights are read.
refine::HeightTiles::Heights survey_tiles(const SurveyFile& file, double water_level_m,
                                          const SurveyScatter& scatter = {});

/// Samples of a survey that is too large to be read whole: the heights of 64 parts of 32 x 32
/// points, spread over the survey. If these have no heights, there are 4096 parts more.
struct SurveySample {
  double mean_m = 0.0;
  double lowest_m = std::numeric_limits<double>::infinity();
  double highest_m = -std::numeric_limits<double>::infinity();
  std::vector<Heightfield> parts;  ///< with their heights
};
/// Throws as read_survey(), and refine::MeshError if no part has heights.
SurveySample sample_survey(const SurveyFile& file, double water_level_m);

/// The files that are read together with a file of a scene, sorted: the sources of a mosaic, and
/// the files beside a raster (FilesBeside::read()). All lie in the file's folder or below this
/// folder. Empty for a file that is no raster or is missing. Throws refine::MeshError for a mosaic
/// that read_survey() refuses because of its sources, and for a file that FilesBeside refuses.
std::vector<std::filesystem::path> files_behind(const std::filesystem::path& file);

/// The grid without heights, from the file's header. Throws as read_survey() for the header.
Heightfield read_survey_header(const SurveyFile& file);

}  // namespace ensonify::engine
