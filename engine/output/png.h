#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/engine/image/display.h>

namespace ensonify::engine {

/// A grey or RGB PNG of 8 or 16 bits, with nothing in it of when or where it was made. Throws
/// std::invalid_argument for a picture without pixels, or whose pixels do not fit its size.
std::vector<std::byte> encode_png(const Picture& picture);

}  // namespace ensonify::engine
