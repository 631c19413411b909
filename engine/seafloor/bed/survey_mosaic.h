#pragma once

#include <filesystem>
#include <vector>

namespace ensonify::engine {

/// The files of a VRT mosaic. It may only put local files together: throws refine::MeshError for
/// whatever else GDAL would do for such a file (fetch, call functions, warp, open other mosaics),
/// for files of other formats than surveys have, and for files outside its own folder. GDAL's
/// drivers must be registered.
std::vector<std::filesystem::path> files_of_mosaic(const std::filesystem::path& file);

}  // namespace ensonify::engine
