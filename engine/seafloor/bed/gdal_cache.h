#pragma once

#include <cstdint>

namespace ensonify::engine {

/// The bytes of pixels that GDAL may keep in memory. GDAL's default is a share of the machine's
/// memory. The layout of a file that GDAL writes depends on this number, because pixels are written
/// when they leave the memory.
inline constexpr std::int64_t gdal_cache_bytes = 64 << 20;

}  // namespace ensonify::engine
