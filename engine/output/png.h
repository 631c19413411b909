#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ensonify/engine/image/display.h>

namespace ensonify::engine {

/// A grey or RGB PNG with 8 or 16 bits per channel, without time or host. Throws
/// std::invalid_argument if the picture is empty or its pixels do not fit its size.
std::vector<std::byte> encode_png(const Picture& picture);

/// Numbers, row by row from the top, as a grey PNG with 16 bits. Throws as encode_png().
std::vector<std::byte> encode_png16(std::size_t width, std::span<const std::uint16_t> pixels);

}  // namespace ensonify::engine
