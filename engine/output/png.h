#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <ensonify/engine/image/display.h>

namespace ensonify::engine {

/// Keywords and texts about a picture, in ASCII (tEXt chunks of a PNG).
using PngTexts = std::vector<std::pair<std::string, std::string>>;

/// The most bytes of pixels per byte of a PNG: zlib's limit (zlib Technical Details).
constexpr double max_png_compression = 1032.0;

/// The size of a picture and the kind of its pixels: grey or RGB, 8 or 16 bits per channel.
struct PngFormat {
  std::size_t width = 0, height = 0;
  int channels = 1;
  int bits = 8;
  PngTexts texts = {};

  std::size_t row_bytes() const {
    return width * static_cast<std::size_t>(channels) * static_cast<std::size_t>(bits / 8);
  }
};

/// Writes a PNG row by row, without date and name of a computer: equal pictures give equal files.
class PngWriter {
 public:
  /// Passes the file's bytes to `sink`, in order; exceptions of `sink` reach the caller. Throws
  /// std::invalid_argument for an empty picture, and unless it is grey or RGB with 8 or 16 bits.
  PngWriter(const PngFormat& format, std::function<void(std::span<const std::byte>)> sink);
  ~PngWriter();
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  /// Adds whole rows, from the top down, in the layout of Picture::pixels.
  void add_rows(std::span<const std::uint8_t> rows);
  /// Call this once, after the last row.
  void finish();

 private:
  struct Impl;
  std::size_t row_bytes_;
  std::unique_ptr<Impl> impl_;
};

/// A whole picture as a PNG. Throws std::invalid_argument if the picture is empty or its pixels do
/// not fit its size.
std::vector<std::byte> encode_png(const Picture& picture, const PngTexts& texts = {});

/// Reads a PNG of the kinds that encode_png() writes. Throws std::runtime_error for other content.
Picture decode_png(std::span<const std::byte> bytes);

/// Numbers, row by row from the top, as a grey PNG with 16 bits. Throws as encode_png().
std::vector<std::byte> encode_png16(std::size_t width, std::span<const std::uint16_t> pixels);

}  // namespace ensonify::engine
