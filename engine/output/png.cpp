#include <ensonify/engine/output/png.h>

#include <stdexcept>
#include <string>

#include <png.h>

namespace ensonify::engine {

namespace {

std::vector<std::byte> encode(std::size_t width, std::size_t height, png_uint_32 format,
                              const void* pixels) {
  // libpng's simplified interface: errors come back as values, not by longjmp.
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = format;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::byte> bytes(size);
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels, 0, nullptr))
    throw std::runtime_error(std::string("cannot make a PNG: ") + image.message);
  bytes.resize(size);
  return bytes;
}

}  // namespace

std::vector<std::byte> encode_png(const Picture& picture) {
  if (picture.pixels.empty() || (picture.channels != 1 && picture.channels != 3) ||
      picture.pixels.size() !=
          picture.width * picture.height * static_cast<std::size_t>(picture.channels))
    throw std::invalid_argument("encode_png: pixels that do not fit the picture's size");
  return encode(picture.width, picture.height,
                picture.channels == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB, picture.pixels.data());
}

std::vector<std::byte> encode_png16(std::size_t width, std::span<const std::uint16_t> pixels) {
  if (pixels.empty() || width == 0 || pixels.size() % width != 0)
    throw std::invalid_argument("encode_png16: pixels that do not fit the width");
  // libpng calls 16 bits linear; the numbers are left as they are.
  return encode(width, pixels.size() / width, PNG_FORMAT_LINEAR_Y, pixels.data());
}

}  // namespace ensonify::engine
