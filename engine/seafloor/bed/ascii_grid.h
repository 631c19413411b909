#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// The fault of the heights of an ESRI ASCII grid, as a text for a message; empty if there is none.
/// `columns` and `rows` are from the file's header. GDAL reads words as zeros and accepts a short
/// last line, so this function checks and counts each number.
std::string fault_of_ascii_grid(const std::filesystem::path& file, int columns, int rows);

}  // namespace ensonify::engine
