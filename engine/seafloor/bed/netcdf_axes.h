#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace ensonify::engine {

/// The fault in the coordinates of a variable of a netCDF file, in words for a message. GDAL takes
/// the last dimension as the east and the one before it as the north, assumes equal steps, and
/// ignores units. Empty if x and y are in that order, in metres, and have equal steps, or if the
/// file names no coordinates. Not safe for threads, as HDF5 is.
std::string fault_of_netcdf_axes(const std::filesystem::path& file, std::string_view variable);

}  // namespace ensonify::engine
