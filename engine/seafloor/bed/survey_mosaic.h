#pragma once

#include <filesystem>
#include <vector>

namespace ensonify::engine {

/// The source files of a VRT mosaic. A mosaic may only join local files. Throws refine::MeshError
/// if the VRT makes GDAL do anything else (fetch, call functions, warp, open other mosaics), and
/// for sources that are not in the formats of surveys or not in the mosaic's folder or below it.
/// GDAL's drivers must be registered.
std::vector<std::filesystem::path> files_of_mosaic(const std::filesystem::path& file);

}  // namespace ensonify::engine
