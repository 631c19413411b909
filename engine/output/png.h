#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/image/display.h>

namespace ensonify::engine {

/// A grey or RGB PNG of 8 or 16 bits, independent of when or where it is made. Throws
/// std::invalid_argument for a picture without pixels, or if they do not fit its size.
std::vector<std::byte> encode_png(const Picture& picture);

/// Numbers row by row from the top as a grey PNG of 16 bits. Throws as above.
std::vector<std::byte> encode_png16(std::size_t width, std::span<const std::uint16_t> pixels);

}  // namespace ensonify::engine
