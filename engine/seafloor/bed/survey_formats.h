#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

class GDALDataset;
class OGRSpatialReference;

namespace ensonify::engine {

// Only formats that keep the heights in one file, because other formats (WMS) can name other files
// and hosts. A VRT is opened only after everything that it names is checked.
inline constexpr std::array<const char*, 5> survey_drivers = {"GTiff", "BAG", "AAIGrid", "netCDF",
                                                              nullptr};

/// Whether a file is HDF5, as BAG files and newer netCDF files are. HDF5 is not safe for threads.
bool is_hdf5(const std::filesystem::path& file);
/// Whether a file is a VRT, which is a mosaic of other files.
bool is_mosaic(const std::filesystem::path& file);
/// Whether a dataset is a BAG of variable resolution.
bool has_refinements(GDALDataset& dataset);
/// Whether a raster's metadata name a file with overviews. GDAL would open any such file, in any
/// folder.
bool names_overviews(GDALDataset& dataset);
/// A file that a scene can name as its seafloor.
struct SeafloorFile {
  std::string_view is;    ///< "a mesh"
  std::string_view kind;  ///< the word of seafloor.kind, and the key that takes the file
};
/// The kind of a file: by its first bytes, or for a mesh by its name. Unset for soundings and for
/// all other files.
std::optional<SeafloorFile> seafloor_file(const std::filesystem::path& file);
/// The message "FILE: is a mesh, expected WANTED; ...", which also says how a scene takes the file.
std::string fault_of_kind(const std::filesystem::path& file, const SeafloorFile& found,
                          std::string_view wanted);
/// A coordinate reference system as WKT; empty if GDAL cannot write it.
std::string wkt_of(const OGRSpatialReference& reference);

}  // namespace ensonify::engine
