#include <ensonify/engine/output/exr.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <type_traits>
#include <variant>

#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>
#include <nlohmann/json.hpp>

namespace ensonify::engine {
namespace {

/// OpenEXR would leave a truncated file on a full disk, so it writes to memory.
class MemoryStream final : public Imf::OStream {
 public:
  explicit MemoryStream(std::size_t expected_bytes) : Imf::OStream("memory") {
    bytes.reserve(expected_bytes);
  }

  void write(const char* data, int count) override {
    const auto* from = reinterpret_cast<const std::byte*>(data);
    const auto size = static_cast<std::size_t>(count);
    if (bytes.size() < place_) bytes.resize(place_);
    // Overwritten at the end is only the table of lines; new bytes are not cleared beforehand.
    const std::size_t over = std::min(size, bytes.size() - place_);
    std::copy_n(from, over, bytes.begin() + offset());
    bytes.insert(bytes.end(), from + over, from + size);
    place_ += size;
  }
  std::uint64_t tellp() override { return place_; }
  void seekp(std::uint64_t place) override { place_ = place; }

  std::vector<std::byte> bytes;

 private:
  std::ptrdiff_t offset() const { return static_cast<std::ptrdiff_t>(place_); }
  std::size_t place_ = 0;
};

Imf::Compression compression(ExrCompression chosen) {
  switch (chosen) {
    case ExrCompression::none: return Imf::NO_COMPRESSION;
    case ExrCompression::rle: break;
    case ExrCompression::zip: return Imf::ZIP_COMPRESSION;
    case ExrCompression::piz: return Imf::PIZ_COMPRESSION;
  }
  return Imf::RLE_COMPRESSION;
}

Imf::Header make_header(const Waterfall& waterfall, const ImageOrigin& origin) {
  Imf::Header header(static_cast<int>(waterfall.columns()), static_cast<int>(waterfall.rows()));
  header.compression() = compression(origin.encoding.exr_compression);
  for (const auto& [name, value] : image_attributes(waterfall, origin)) {
    if (const auto* text = std::get_if<std::string>(&value))
      header.insert(name, Imf::StringAttribute(*text));
    else if (const auto* real = std::get_if<double>(&value))
      header.insert(name, Imf::DoubleAttribute(*real));
    else if (const auto* texts = std::get_if<std::vector<std::string>>(&value))
      header.insert(name, Imf::StringAttribute(nlohmann::json(*texts).dump(
                              -1, ' ', false, nlohmann::json::error_handler_t::replace)));
    else
      header.insert(name, Imf::IntAttribute(std::get<int>(value)));
  }
  return header;
}

/// The luminance of a waterfall's preview, in the layers' order of rows. Viewers turn linear values
/// into those of sRGB (IEC 61966-2-1), and so show the grey levels of the picture.
std::vector<half> luminance(const Waterfall& waterfall, const Picture& picture) {
  std::array<half, 256> linear;
  for (std::size_t i = 0; i < linear.size(); ++i) {
    const double level = static_cast<double>(i) / 255.0;
    linear[i] = static_cast<float>(level <= 0.04045 ? level / 12.92
                                                    : std::pow((level + 0.055) / 1.055, 2.4));
  }
  const std::size_t rows = waterfall.rows(), columns = waterfall.columns();
  if (picture.width != columns || picture.height != rows || picture.channels != 1 ||
      picture.bits != 8)
    throw std::invalid_argument("encode_exr: the preview is not a grey picture of the waterfall");
  std::vector<half> values(rows * columns);
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t column = 0; column < columns; ++column)
      values[row * columns + column] = linear[picture.pixels[(rows - 1 - row) * columns + column]];
  return values;
}

}  // namespace

void set_exr_threads(int threads) { Imf::setGlobalThreadCount(threads > 1 ? threads : 0); }

std::vector<std::byte> encode_exr(const Waterfall& waterfall, const ImageOrigin& origin) {
  if (waterfall.rows() == 0 || waterfall.columns() == 0)
    throw std::invalid_argument("encode_exr: the waterfall has no pixels");
  Imf::Header header = make_header(waterfall, origin);
  Imf::FrameBuffer frame;
  std::size_t frame_layers = 0;
  BinLayers::for_each([&](std::string_view name, auto layer) {
    if (!origin.has_layer(name)) return;
    ++frame_layers;
    const auto& values = waterfall.pixels.*layer;
    using Value = typename std::decay_t<decltype(values)>::value_type;
    constexpr Imf::PixelType type = std::is_same_v<Value, float> ? Imf::FLOAT : Imf::UINT;
    // FrameBuffer is also used for reading, so it takes non-const data; OutputFile only reads it.
    char* data = reinterpret_cast<char*>(const_cast<Value*>(values.data()));
    header.channels().insert(std::string(name), Imf::Channel(type));
    frame.insert(std::string(name),
                 Imf::Slice(type, data, sizeof(Value), sizeof(Value) * waterfall.columns()));
  });
  std::vector<half> preview;
  if (origin.preview) {
    preview = luminance(waterfall, origin.preview());
    header.channels().insert("Y", Imf::Channel(Imf::HALF));
    frame.insert("Y", Imf::Slice(Imf::HALF, reinterpret_cast<char*>(preview.data()), sizeof(half),
                                 sizeof(half) * waterfall.columns()));
  }
  MemoryStream stream(waterfall.rows() * waterfall.columns() *
                      (4 * frame_layers + (preview.empty() ? 0 : sizeof(half))));
  {
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(frame);
    file.writePixels(static_cast<int>(waterfall.rows()));
  }
  return std::move(stream.bytes);
}

}  // namespace ensonify::engine
