#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

class GDALDataset;
class GDALRasterBand;

namespace ensonify::engine {

// The functions fault_of_...() return the fault of a survey's file and what to do, as the part of a
// message after the file's name; empty if there is no fault. `transform` is GDAL's: west, step
// east, turn, north, turn, step north.

/// The fault of a header that promises more cells than the file can hold. Call this before memory
/// is allocated. A cell of a text needs two bytes, and no compression packs a thousand real heights
/// into one byte. `file_bytes` is unset for a grid in memory.
std::string fault_of_size(GDALRasterBand& band, std::optional<double> file_bytes, bool is_text);

/// The fault of a grid that is not north-up or whose cells have impossible sizes.
std::string fault_of_transform(const std::array<double, 6>& transform, int columns, int rows);

/// The fault of a grid that is not in metres, on the map and in height. `cell_is_given`: the user
/// has given the size of the cells in metres.
std::string fault_of_reference(GDALDataset& dataset, GDALRasterBand& band,
                               const std::filesystem::path& file,
                               const std::array<double, 6>& transform, bool cell_is_given);

/// The UTM zone of a grid, negative in the south; 0 if there is none. Also 0 if the ellipsoid
/// differs from that of WGS 84 by more than a millimetre. Datums with such an ellipsoid (GRS 80:
/// NAD83, ETRS89, GDA94) agree with WGS 84 within two metres; older datums do not.
int utm_zone(GDALDataset& dataset);

/// The fault of the heights of an ESRI ASCII grid; `columns` and `rows` are from the file's header.
/// GDAL reads words as zeros and accepts a short last line, so this checks and counts each number.
std::string fault_of_ascii_grid(const std::filesystem::path& file, int columns, int rows);

/// The fault in the coordinates of a variable of a netCDF file: dimensions in another order, not in
/// metres, or with unequal steps. GDAL takes the last dimension as east and the dimension before it
/// as north, assumes equal steps, and ignores units. A file without coordinates has no such fault.
/// Not safe for threads, because HDF5 is not.
std::string fault_of_netcdf_axes(const std::filesystem::path& file, std::string_view variable);

/// The fault of an HDF5 file (a BAG, a newer netCDF) that has parts in other files: by a link, as
/// the bytes of a table, or as a virtual table. HDF5 would open such files in any folder without
/// being asked. HDF5 is not safe for threads.
std::string fault_of_hdf5(const std::filesystem::path& file);

/// Whether a unit in a file, in upper or lower case, is the metre. An empty unit counts as metre.
bool is_metre(std::string_view unit);

}  // namespace ensonify::engine
