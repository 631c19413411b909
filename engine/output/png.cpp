#include <ensonify/engine/output/png.h>

#include <csetjmp>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>

#include <png.h>

namespace ensonify::engine {
namespace {

/// libpng's structures, and what it writes.
struct Writer {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::vector<std::byte> bytes;
  std::string error;
  bool full = false;
  ~Writer() { png_destroy_write_struct(&png, &info); }
};

void fail(png_structp png, png_const_charp message) {
  static_cast<Writer*>(png_get_error_ptr(png))->error = message;
  png_longjmp(png, 1);
}

void append(png_structp png, png_bytep data, png_size_t size) {
  auto& writer = *static_cast<Writer*>(png_get_io_ptr(png));
  try {
    const auto* bytes = reinterpret_cast<const std::byte*>(data);
    writer.bytes.insert(writer.bytes.end(), bytes, bytes + size);
  } catch (const std::bad_alloc&) {  // an exception must not pass through C code
    writer.full = true;
  }
}

/// Returns false on an error. No local may have a destructor here: libpng leaves by longjmp.
bool write(Writer& writer, const Picture& picture) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(picture.width),
               static_cast<png_uint_32>(picture.height), picture.bits,
               picture.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer.png, writer.info);
  const std::size_t row_bytes = picture.pixels.size() / picture.height;
  for (std::size_t row = 0; row < picture.height; ++row)
    png_write_row(writer.png, picture.pixels.data() + row * row_bytes);
  png_write_end(writer.png, nullptr);
  return true;
}

}  // namespace

std::vector<std::byte> encode_png(const Picture& picture) {
  if (picture.pixels.empty() || (picture.channels != 1 && picture.channels != 3) ||
      (picture.bits != 8 && picture.bits != 16) ||
      picture.pixels.size() != picture.width * picture.height *
                                   static_cast<std::size_t>(picture.channels) *
                                   static_cast<std::size_t>(picture.bits / 8))
    throw std::invalid_argument("encode_png: the pixels do not fit the picture's size");
  Writer writer;
  writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &writer, fail, nullptr);
  if (writer.png) writer.info = png_create_info_struct(writer.png);
  if (!writer.info) throw std::bad_alloc();
  png_set_write_fn(writer.png, &writer, append, nullptr);
  if (!write(writer, picture)) throw std::runtime_error("cannot make a PNG: " + writer.error);
  if (writer.full) throw std::bad_alloc();
  return std::move(writer.bytes);
}

std::vector<std::byte> encode_png16(std::size_t width, std::span<const std::uint16_t> pixels) {
  if (pixels.empty() || width == 0 || pixels.size() % width != 0)
    throw std::invalid_argument("encode_png16: the pixels do not fit the width");
  Picture picture{width, pixels.size() / width, 1, {}, 16};
  picture.pixels.reserve(2 * pixels.size());
  for (const std::uint16_t pixel : pixels) {
    picture.pixels.push_back(static_cast<std::uint8_t>(pixel >> 8));
    picture.pixels.push_back(static_cast<std::uint8_t>(pixel & 0xff));
  }
  return encode_png(picture);
}

}  // namespace ensonify::engine
