#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// What is wrong with the heights of an ESRI ASCII grid whose header promises so many columns and
/// rows, in words for a message; empty if nothing. GDAL reads words as zeros and accepts a short
/// last line, so each number is checked and counted here.
std::string fault_of_ascii_grid(const std::filesystem::path& file, int columns, int rows);

}  // namespace ensonify::engine
