#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// The fault of an HDF5 file (a BAG, a newer netCDF) that has parts in other files: by a link, as
/// the bytes of a table, or as a virtual table. HDF5 would open such files in any folder without
/// being asked. Empty if there are no such parts. HDF5 is not safe for threads.
std::string fault_of_hdf5(const std::filesystem::path& file);

}  // namespace ensonify::engine
