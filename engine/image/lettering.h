#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <ensonify/engine/image/display.h>

namespace ensonify::engine {

using Rgb = std::array<std::uint8_t, 3>;

/// The height of a line and the width of a letter with the gap after it, in pixels at size 1.
inline constexpr std::size_t letter_height_px = 8, letter_width_px = 6;

/// Writes printable ASCII into a picture of three channels, in dots of size x size pixels. `left`
/// and `top` are the upper left corner; dots outside the picture are clipped. Other characters are
/// drawn as '?'.
void write_text(Picture& picture, std::size_t left, std::size_t top, std::size_t size,
                const Rgb& colour, std::string_view text);

}  // namespace ensonify::engine
