#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <ensonify/engine/image/display.h>

namespace ensonify::engine {

using Rgb = std::array<std::uint8_t, 3>;

/// Colours from numbers 0xRRGGBB.
template <std::size_t n>
constexpr std::array<Rgb, n> rgb_colours(const std::uint32_t (&numbers)[n]) {
  std::array<Rgb, n> colours{};
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      colours[i][k] = static_cast<std::uint8_t>(numbers[i] >> (16 - 8 * k) & 0xff);
  return colours;
}

/// The height of a line and the width of a letter with the gap after it, in pixels at size 1.
inline constexpr std::size_t letter_height_px = 8, letter_width_px = 6;

/// Writes printable ASCII into a picture of three channels, in dots of size x size pixels. `left`
/// and `top` are the upper left corner; dots outside the picture are clipped. Other characters are
/// drawn as '?'.
void write_text(Picture& picture, std::size_t left, std::size_t top, std::size_t size,
                const Rgb& colour, std::string_view text);

}  // namespace ensonify::engine
