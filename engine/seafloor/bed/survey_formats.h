#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

class GDALDataset;
class OGRSpatialReference;

namespace ensonify::engine {

// Only formats that keep the heights in one file: others (WMS) can name other files and hosts. A
// VRT is opened only after everything that it names was checked.
inline constexpr std::array<const char*, 5> survey_drivers = {"GTiff", "BAG", "AAIGrid", "netCDF",
                                                              nullptr};

/// Whether it is HDF5, as BAG files and newer netCDF files are. HDF5 is not safe for threads.
bool is_hdf5(const std::filesystem::path& file);
/// A VRT file, which puts other files together.
bool is_mosaic(const std::filesystem::path& file);
/// Whether it is a BAG of variable resolution.
bool has_refinements(GDALDataset& dataset);
/// Whether a raster's own metadata name a file with its overviews. GDAL would open it, whatever and
/// wherever it is.
bool names_overviews(GDALDataset& dataset);
/// A file that a scene can name as its seafloor.
struct SeafloorFile {
  std::string_view is;    ///< "a mesh"
  std::string_view kind;  ///< the word of seafloor.kind, and the key that takes the file
};
/// What a file is by its first bytes, a mesh by its name; nothing for soundings and for any other.
std::optional<SeafloorFile> seafloor_file(const std::filesystem::path& file);
/// "FILE: is a mesh, expected WANTED; ...", with how a scene takes the file.
std::string fault_of_kind(const std::filesystem::path& file, const SeafloorFile& found,
                          std::string_view wanted);
/// A coordinate reference system as WKT; empty if that cannot be made.
std::string wkt_of(const OGRSpatialReference& reference);

}  // namespace ensonify::engine
