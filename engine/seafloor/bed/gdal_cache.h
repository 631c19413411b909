#pragma once

#include <cstdint>

namespace ensonify::engine {

/// The bytes of pixels that GDAL keeps in memory. Its own default is a share of the machine's
/// memory, and where parts of a file that it writes lie depends on when they leave the memory.
inline constexpr std::int64_t gdal_cache_bytes = 64 << 20;

}  // namespace ensonify::engine
