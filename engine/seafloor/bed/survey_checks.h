#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

class GDALDataset;
class GDALRasterBand;

namespace ensonify::engine {

// The fault in the header of a survey's grid, and what to do, as the part of a message after the
// file's name; empty if there is none. Transforms are GDAL's: west, step east, turn, north, turn,
// step north.

/// Refuses headers that promise more cells than the file can hold, before anything is allocated: a
/// text cell needs two bytes, and no compression packs a thousand real heights into one byte.
/// `file_bytes` is unset for a grid in memory.
std::string fault_of_size(GDALRasterBand& band, std::optional<double> file_bytes, bool is_text);

std::string fault_of_transform(const std::array<double, 6>& transform, int columns, int rows);

/// Only grids in metres, on the map and in height, are read. `cell_is_given`: in metres, by the
/// user.
std::string fault_of_reference(GDALDataset& dataset, GDALRasterBand& band,
                               const std::filesystem::path& file,
                               const std::array<double, 6>& transform, bool cell_is_given);

/// 0 if there is none. Only for an ellipsoid within a millimetre of that of WGS 84 (such as GRS
/// 80): datums that use it (NAD83, ETRS89, GDA94) agree with WGS 84 within two metres, older ones
/// do not.
int utm_zone(GDALDataset& dataset);

}  // namespace ensonify::engine
