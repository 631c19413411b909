#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <ensonify/engine/image/display.h>

namespace ensonify::engine {

using Rgb = std::array<std::uint8_t, 3>;

inline constexpr std::size_t letter_width_px = 6,
                             letter_height_px = 9;  ///< with the space about them

/// Writes printable ASCII into a picture of three channels, the letters' left upper corner at (column, row); what
/// does not fit is cut off. Other characters are drawn as '?'.
void draw_text(Picture& picture, std::size_t column, std::size_t row, std::string_view text,
               const Rgb& colour);

}  // namespace ensonify::engine
