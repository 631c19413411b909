#include <ensonify/engine/output/png.h>

#include <stdexcept>
#include <string>

#include <png.h>

namespace ensonify::engine {

std::vector<std::byte> encode_png(const Picture& picture) {
  if (picture.pixels.empty() || (picture.channels != 1 && picture.channels != 3) ||
      picture.pixels.size() !=
          picture.width * picture.height * static_cast<std::size_t>(picture.channels))
    throw std::invalid_argument("encode_png: pixels that do not fit the picture's size");
  // libpng's simplified interface: errors come back as values, not by longjmp.
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = picture.channels == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::byte> bytes(size);
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.pixels.data(), 0, nullptr))
    throw std::runtime_error(std::string("cannot make a PNG: ") + image.message);
  bytes.resize(size);
  return bytes;
}

}  // namespace ensonify::engine
