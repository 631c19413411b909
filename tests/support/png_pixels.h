#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <png.h>

#include "support/catch.h"

namespace ensonify::tests {

/// The values of a grey PNG of 8 bits, or 16 bits if `wide`, row by row from the top.
inline std::vector<std::uint16_t> png_pixels(std::span<const std::byte> png, bool wide) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_memory(&image, png.data(), png.size()));
  image.format = wide ? PNG_FORMAT_LINEAR_Y : PNG_FORMAT_GRAY;
  const std::size_t count = std::size_t{image.width} * image.height;
  if (wide) {
    std::vector<std::uint16_t> pixels(count);
    REQUIRE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr));
    return pixels;
  }
  std::vector<std::uint8_t> pixels(count);
  REQUIRE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr));
  return {pixels.begin(), pixels.end()};
}

}  // namespace ensonify::tests
