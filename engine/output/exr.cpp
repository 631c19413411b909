#include <ensonify/engine/output/exr.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <exception>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <variant>
#include <vector>

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
#include <OpenEXR/ImfVersion.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/output/rle_lines.h>

namespace ensonify::engine {
namespace {

/// Collects the bytes that OpenEXR writes, and writes them in large pieces.
class ExrStream final : public Imf::OStream {
 public:
  explicit ExrStream(const refine::WriteAt& write_at) : Imf::OStream("EXR"), write_at_(write_at) {
    piece_.reserve(piece_bytes);
  }

  void write(const char* data, int count) override {
    const auto bytes = std::as_bytes(std::span(data, static_cast<std::size_t>(count)));
    if (piece_.size() + bytes.size() > piece_bytes) write_piece();
    piece_.insert(piece_.end(), bytes.begin(), bytes.end());
  }
  std::uint64_t tellp() override { return place_ + piece_.size(); }
  void seekp(std::uint64_t place) override {
    write_piece();
    place_ = place;
  }
  /// Throws an error of an earlier write, because OpenEXR ignores errors while it closes a file.
  void finish() { write_piece(); }

 private:
  void write_piece() {
    if (error_) std::rethrow_exception(error_);
    if (piece_.empty()) return;
    try {
      write_at_(place_, piece_);
    } catch (...) {
      error_ = std::current_exception();
      throw;
    }
    place_ += piece_.size();
    piece_.clear();
  }

  static constexpr std::size_t piece_bytes = std::size_t{1} << 18;
  const refine::WriteAt& write_at_;
  std::vector<std::byte> piece_;
  std::uint64_t place_ = 0;  // of the piece in the file
  std::exception_ptr error_;
};

Imf::Header make_header(const Waterfall& waterfall, const ImageOrigin& origin) {
  Imf::Header header(static_cast<int>(waterfall.columns()), static_cast<int>(waterfall.rows()));
  constexpr std::array compressions{Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIP_COMPRESSION,
                                    Imf::PIZ_COMPRESSION};  // in the order of ExrCompression
  header.compression() = compressions[static_cast<std::size_t>(origin.encoding.exr_compression)];
  for (const auto& [name, value] : image_attributes(waterfall, origin)) {
    if (const auto* text = std::get_if<std::string>(&value))
      header.insert(name, Imf::StringAttribute(*text));
    else if (const auto* real = std::get_if<double>(&value))
      header.insert(name, Imf::DoubleAttribute(*real));
    else if (const auto* texts = std::get_if<std::vector<std::string>>(&value))
      header.insert(name, Imf::StringAttribute(json_text(nlohmann::json(*texts))));
    else
      header.insert(name, Imf::IntAttribute(std::get<int>(value)));
  }
  return header;
}

/// The luminance of a waterfall's preview, in the layers' order of rows. It is linear: viewers
/// convert it to sRGB (IEC 61966-2-1) and then show the grey levels of the picture.
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

static_assert(std::endian::native == std::endian::little, "as in the file");

/// Writes the header, the table of the places of all lines, and the lines with RLE compression. The
/// bytes are the same as those of Imf::OutputFile, whose RLE compression takes most of its time.
void write_rle(ExrStream& stream, const Imf::Header& header, const Imf::FrameBuffer& frame,
               std::size_t rows) {
  const auto put = [&](const auto& values) {
    const auto bytes = std::as_bytes(std::span(values));
    stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<int>(bytes.size()));
  };
  struct Channel {
    const char* values;
    std::size_t row_bytes;
  };
  std::vector<Channel> channels;
  std::size_t line_bytes = 0;
  for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
    const Imf::Slice& slice = *frame.findSlice(channel.name());
    channels.push_back({slice.base, slice.yStride});
    line_bytes += slice.yStride;
  }
  put(std::array{Imf::MAGIC, Imf::EXR_VERSION});
  header.writeTo(stream);
  const std::uint64_t table = stream.tellp();
  std::vector<std::uint64_t> places(rows);
  put(places);
  RleLines lines(line_bytes);
  for (std::size_t row = 0; row < rows; ++row) {
    for (const Channel& channel : channels)
      lines.add(
          std::as_bytes(std::span(channel.values + row * channel.row_bytes, channel.row_bytes)));
    const std::span<const std::byte> packed = lines.pack();
    places[row] = stream.tellp();
    put(std::array{static_cast<std::int32_t>(row), static_cast<std::int32_t>(packed.size())});
    put(packed);
  }
  stream.seekp(table);
  put(places);
}

}  // namespace

void set_exr_threads(int threads) { Imf::setGlobalThreadCount(threads > 1 ? threads : 0); }

void encode_exr(const Waterfall& waterfall, const ImageOrigin& origin,
                const refine::WriteAt& write_at) {
  if (waterfall.rows() == 0 || waterfall.columns() == 0)
    throw std::invalid_argument("encode_exr: the waterfall has no pixels");
  Imf::Header header = make_header(waterfall, origin);
  Imf::FrameBuffer frame;
  BinLayers::for_each([&](std::string_view name, auto layer) {
    if (!origin.has_layer(name)) return;
    const auto& values = waterfall.pixels.*layer;
    using Value = typename std::decay_t<decltype(values)>::value_type;
    constexpr Imf::PixelType type = std::is_same_v<Value, float> ? Imf::FLOAT : Imf::UINT;
    // FrameBuffer takes non-const data, because it is also for reading; OutputFile only reads it.
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
  ExrStream stream(write_at);
  if (header.compression() == Imf::RLE_COMPRESSION) {
    write_rle(stream, header, frame, waterfall.rows());
  } else {
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(frame);
    file.writePixels(static_cast<int>(waterfall.rows()));
  }
  stream.finish();
}

}  // namespace ensonify::engine
