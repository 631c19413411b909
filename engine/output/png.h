#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include <ensonify/engine/image/display.h>

namespace ensonify::engine {

/// The size of a picture and of its pixels: grey or RGB, 8 or 16 bits per channel.
struct PngFormat {
  std::size_t width = 0, height = 0;
  int channels = 1;
  int bits = 8;

  std::size_t row_bytes() const {
    return width * static_cast<std::size_t>(channels) * static_cast<std::size_t>(bits / 8);
  }
};

/// A PNG that is made row by row, without time or host.
class PngWriter {
 public:
  /// `sink` takes the file's bytes in order; what it throws is passed on. Throws
  /// std::invalid_argument for another format.
  PngWriter(const PngFormat& format, std::function<void(std::span<const std::byte>)> sink);
  ~PngWriter();
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  /// Whole rows from the top, as Picture::pixels.
  void add_rows(std::span<const std::uint8_t> rows);
  /// To be called once, after the last row.
  void finish();

 private:
  struct Impl;
  std::size_t row_bytes_;
  std::unique_ptr<Impl> impl_;
};

/// A whole picture as a PNG. Throws std::invalid_argument if the picture is empty or its pixels do
/// not fit its size.
std::vector<std::byte> encode_png(const Picture& picture);

/// The picture of a PNG that encode_png() can make. Throws std::runtime_error for other content.
Picture decode_png(std::span<const std::byte> bytes);

/// Numbers, row by row from the top, as a grey PNG with 16 bits. Throws as encode_png().
std::vector<std::byte> encode_png16(std::size_t width, std::span<const std::uint16_t> pixels);

}  // namespace ensonify::engine
