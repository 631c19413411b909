#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

class GDALDataset;
class OGRSpatialReference;

namespace ensonify::engine {

// These formats keep the heights in one file. Other formats, such as WMS, can name other files and
// hosts, so GDAL may not open them here. A VRT is opened only after everything that it names is
// checked.
inline constexpr std::array<const char*, 5> survey_drivers = {"GTiff", "BAG", "AAIGrid", "netCDF",
                                                              nullptr};

/// Whether a file is HDF5, as BAG files and newer netCDF files are. HDF5 is not safe for threads.
bool is_hdf5(const std::filesystem::path& file);
/// Whether a file is a VRT, which is a mosaic of other files.
bool is_mosaic(const std::filesystem::path& file);
/// Whether a dataset is a BAG of variable resolution.
bool has_refinements(GDALDataset& dataset);
/// Whether a raster's metadata name a file with overviews, which GDAL would open in any folder.
bool names_overviews(GDALDataset& dataset);
/// A file that a scene can name as its seafloor.
struct SeafloorFile {
  std::string_view is;    ///< "a mesh"
  std::string_view kind;  ///< the word of seafloor.kind, and the key that takes the file
};
/// The kind of a file: by its first bytes, or a mesh by its name. Unset for soundings and others.
std::optional<SeafloorFile> seafloor_file(const std::filesystem::path& file);
/// The message "FILE: is a mesh, expected WANTED; ...", which also states the keys with which a
/// scene uses such a file.
std::string fault_of_kind(const std::filesystem::path& file, const SeafloorFile& found,
                          std::string_view wanted);
/// A coordinate reference system as WKT; empty if GDAL cannot write it.
std::string wkt_of(const OGRSpatialReference& reference);

/// The source files of a VRT mosaic. GDAL's drivers must be registered. Throws refine::MeshError in
/// these cases: the VRT makes GDAL do anything other than join local files (fetch, call functions,
/// warp, open other mosaics); a source is not a GeoTIFF, BAG, ESRI ASCII grid or netCDF file; a
/// source is a BAG of variable resolution; a source is missing, or outside the mosaic's folder and
/// the folders below it; a source could make GDAL open another file.
std::vector<std::filesystem::path> files_of_mosaic(const std::filesystem::path& file);

/// The text of a VRT with which GDAL reads the heights of an .npy file in place. The file has an
/// array of rows from the south, of floats or whole numbers, as `ensonify seafloor` writes it; both
/// byte orders and both of numpy's orders of elements are read. The middle of the grid lies at 0,
/// 0. Throws refine::MeshError for any other file, and for a file that is longer or shorter than
/// its header states.
std::string vrt_of_npy(const std::filesystem::path& file, double cell_m);

/// The bytes of pixels that GDAL may keep in memory. GDAL's default is a share of the machine's
/// memory. The layout of a file that GDAL writes depends on this number, because pixels are written
/// when they leave the memory.
inline constexpr std::int64_t gdal_cache_bytes = 64 << 20;

}  // namespace ensonify::engine
