#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// What is wrong with the heights of an ESRI ASCII grid, in words for a message; empty if nothing.
/// `columns` and `rows` are those of its header. GDAL reads words as zeros and accepts a short
/// last line, so each number is checked and counted here.
std::string fault_of_ascii_grid(const std::filesystem::path& file, int columns, int rows);

}  // namespace ensonify::engine
