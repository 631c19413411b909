#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace ensonify::engine {

/// The fault in the coordinates of a variable of a netCDF file, as a text for a message. GDAL takes
/// the last dimension as east and the dimension before it as north, assumes equal steps, and
/// ignores units. Empty if the dimensions are in this order, in metres, and have equal steps, or if
/// the file names no coordinates. Not safe for threads, because HDF5 is not.
std::string fault_of_netcdf_axes(const std::filesystem::path& file, std::string_view variable);

}  // namespace ensonify::engine
