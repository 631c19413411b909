#pragma once

#include <array>
#include <filesystem>
#include <string>

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
/// A coordinate reference system as WKT; empty if that cannot be made.
std::string wkt_of(const OGRSpatialReference& reference);

}  // namespace ensonify::engine
