#pragma once

#include <filesystem>
#include <string>

namespace ensonify::engine {

/// A VRT by which GDAL reads the heights of a .npy file where they lie: an array of rows from the
/// south, of float or whole numbers, as `ensonify seafloor` writes it, in either byte order and in
/// either of numpy's orders. The middle of the grid lies at 0, 0. Throws refine::MeshError for
/// another file, or one that is not as long as its header says.
std::string vrt_of_npy(const std::filesystem::path& file, double cell_m);

}  // namespace ensonify::engine
