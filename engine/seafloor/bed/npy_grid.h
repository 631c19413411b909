#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// The text of a VRT with which GDAL reads the heights of an .npy file in place. The file has an
/// array of rows from the south, of floats or whole numbers, as `ensonify seafloor` writes it; both
/// byte orders and both of numpy's orders of elements are read. The middle of the grid lies at 0,
/// 0. Throws refine::MeshError for any other file, and for a file that is longer or shorter than
/// its header states.
std::string vrt_of_npy(const std::filesystem::path& file, double cell_m);

}  // namespace ensonify::engine
