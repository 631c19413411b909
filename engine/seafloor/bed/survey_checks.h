#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

class GDALDataset;
class GDALRasterBand;

namespace ensonify::engine {

// The functions fault_of_...() return the fault in the header of a survey's grid and what to do, as
// the part of a message after the file's name; empty if there is no fault. `transform` is GDAL's:
// west, step east, turn, north, turn, step north.

/// The fault of a header that promises more cells than the file can hold. Call this before memory
/// is allocated. A cell of a text needs two bytes, and no compression packs a thousand real heights
/// into one byte. `file_bytes` is unset for a grid in memory.
std::string fault_of_size(GDALRasterBand& band, std::optional<double> file_bytes, bool is_text);

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

}  // namespace ensonify::engine
