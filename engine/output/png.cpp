#include <ensonify/engine/output/png.h>

#include <csetjmp>
#include <cstring>
#include <exception>
#include <new>
#include <stdexcept>

#include <png.h>
#include <zlib.h>

namespace ensonify::engine {
namespace {

bool is_grey_or_rgb(const PngFormat& format) {
  return format.width > 0 && format.height > 0 && (format.channels == 1 || format.channels == 3) &&
         (format.bits == 8 || format.bits == 16);
}

/// libpng's structures for writing, and the receiver of the bytes.
struct Writer {
  explicit Writer(std::function<void(std::span<const std::byte>)> its_sink)
      : sink(std::move(its_sink)) {}
  ~Writer() { png_destroy_write_struct(&png, &info); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  std::function<void(std::span<const std::byte>)> sink;
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string error;
  std::exception_ptr thrown;  // by the sink: an exception must not pass through C code
};

/// For libpng: keeps the message in the Writer or the Reader, and leaves by longjmp.
template <class Owner>
void fail(png_structp png, png_const_charp message) {
  static_cast<Owner*>(png_get_error_ptr(png))->error = message;
  png_longjmp(png, 1);
}

void take_bytes(png_structp png, png_bytep data, png_size_t size) {
  auto& writer = *static_cast<Writer*>(png_get_io_ptr(png));
  if (writer.thrown) return;
  try {
    writer.sink({reinterpret_cast<const std::byte*>(data), size});
  } catch (...) {
    writer.thrown = std::current_exception();
  }
}

// The next functions return false on an error. On an error libpng leaves by longjmp, so no local
// variable in them may have a destructor.

bool begin(Writer& writer, const PngFormat& format, const std::vector<png_text>& texts) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(format.width),
               static_cast<png_uint_32>(format.height), format.bits,
               format.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(writer.png, 1);
  if (format.channels == 1) {
    // Rows are stored as differences from the row above, and zlib looks only for runs of equal
    // bytes: speckle has no other repetitions, and labels repeat the row above. This takes half the
    // time of a full search, and files are smaller (pictures 0.95 times, masks 0.6 to 0.7 times).
    png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
    png_set_compression_strategy(writer.png, Z_RLE);
  } else {
    // The three bytes of a colour repeat; a search for such repetitions halves the file.
    png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_NONE);
  }
  if (!texts.empty())
    png_set_text(writer.png, writer.info, texts.data(), static_cast<int>(texts.size()));
  png_write_info(writer.png, writer.info);
  return true;
}

bool write_row(Writer& writer, const std::uint8_t* row) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  png_write_row(writer.png, row);
  return true;
}

bool end(Writer& writer) {
  if (setjmp(png_jmpbuf(writer.png))) return false;
  png_write_end(writer.png, nullptr);
  return true;
}

void require(bool done, const Writer& writer) {
  if (writer.thrown) std::rethrow_exception(writer.thrown);
  if (!done) throw std::runtime_error("cannot make a PNG: " + writer.error);
}

}  // namespace

struct PngWriter::Impl : Writer {
  using Writer::Writer;
};

PngWriter::PngWriter(const PngFormat& format, std::function<void(std::span<const std::byte>)> sink)
    : row_bytes_(format.row_bytes()), impl_(std::make_unique<Impl>(std::move(sink))) {
  if (!is_grey_or_rgb(format))
    throw std::invalid_argument("PngWriter: not a grey or RGB picture of 8 or 16 bits");
  Writer& writer = *impl_;
  writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &writer, fail<Writer>, nullptr);
  if (writer.png) writer.info = png_create_info_struct(writer.png);
  if (!writer.info) throw std::bad_alloc();
  png_set_write_fn(writer.png, &writer, take_bytes, nullptr);
  std::vector<png_text> texts;
  for (const auto& [keyword, text] : format.texts) {
    png_text& one = texts.emplace_back();
    one.compression = PNG_TEXT_COMPRESSION_NONE;
    one.key = const_cast<char*>(keyword.c_str());  // libpng only reads them
    one.text = const_cast<char*>(text.c_str());
    one.text_length = text.size();
  }
  require(begin(writer, format, texts), writer);
}
PngWriter::~PngWriter() = default;

void PngWriter::add_rows(std::span<const std::uint8_t> rows) {
  for (std::size_t at = 0; at < rows.size(); at += row_bytes_)
    require(write_row(*impl_, &rows[at]), *impl_);
}

void PngWriter::finish() { require(end(*impl_), *impl_); }

std::vector<std::byte> encode_png(const Picture& picture, const PngTexts& texts) {
  const PngFormat format{picture.width, picture.height, picture.channels, picture.bits, texts};
  if (picture.pixels.empty() || picture.pixels.size() != format.height * format.row_bytes())
    throw std::invalid_argument("encode_png: the pixels do not fit the picture's size");
  std::vector<std::byte> bytes;
  PngWriter writer(format, [&](std::span<const std::byte> more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
  });
  writer.add_rows(picture.pixels);
  writer.finish();
  return bytes;
}

namespace {

/// libpng's structures for reading, and the bytes that are left to read.
struct Reader {
  std::span<const std::byte> left;
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string error;
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
};

void give_bytes(png_structp png, png_bytep data, png_size_t size) {
  auto& reader = *static_cast<Reader*>(png_get_io_ptr(png));
  if (size > reader.left.size()) png_error(png, "it ends too soon");
  std::memcpy(data, reader.left.data(), size);
  reader.left = reader.left.subspan(size);
}

bool read_header(Reader& reader, Picture& picture) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_info(reader.png, reader.info);
  picture.width = png_get_image_width(reader.png, reader.info);
  picture.height = png_get_image_height(reader.png, reader.info);
  picture.channels = png_get_channels(reader.png, reader.info);
  picture.bits = png_get_bit_depth(reader.png, reader.info);
  return true;
}

bool read_row(Reader& reader, std::uint8_t* row) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_row(reader.png, row, nullptr);
  return true;
}

}  // namespace

Picture decode_png(std::span<const std::byte> bytes) {
  Reader reader{.left = bytes};
  reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader, fail<Reader>, nullptr);
  if (reader.png) reader.info = png_create_info_struct(reader.png);
  if (!reader.info) throw std::bad_alloc();
  png_set_read_fn(reader.png, &reader, give_bytes);
  const auto require_read = [&](bool done) {
    if (!done) throw std::runtime_error("the PNG is damaged: " + reader.error);
  };
  Picture picture;
  require_read(read_header(reader, picture));
  const PngFormat format{picture.width, picture.height, picture.channels, picture.bits};
  if (!is_grey_or_rgb(format)) throw std::runtime_error("the PNG is neither grey nor RGB");
  if (static_cast<double>(picture.height) * static_cast<double>(format.row_bytes()) >
      max_png_compression * static_cast<double>(bytes.size()))
    throw std::runtime_error("the PNG is damaged: it is too short for its pixels");
  picture.pixels.resize(picture.height * format.row_bytes());
  for (std::size_t row = 0; row < picture.height; ++row)
    require_read(read_row(reader, &picture.pixels[row * format.row_bytes()]));
  return picture;
}

std::vector<std::byte> encode_png16(std::size_t width, std::span<const std::uint16_t> pixels) {
  if (pixels.empty() || width == 0 || pixels.size() % width != 0)
    throw std::invalid_argument("encode_png16: the pixels do not fit the width");
  Picture picture{width, pixels.size() / width, 1, {}, 16};
  picture.pixels.resize(2 * pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    picture.pixels[2 * i] = static_cast<std::uint8_t>(pixels[i] >> 8);
    picture.pixels[2 * i + 1] = static_cast<std::uint8_t>(pixels[i] & 0xff);
  }
  return encode_png(picture);
}

}  // namespace ensonify::engine
