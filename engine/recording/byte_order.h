#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <ensonify/engine/recording/recording_bytes.h>

namespace ensonify::engine {

/// Finds out from its samples whether a channel is stored with the highest byte first (big-endian).
class ByteOrder {
 public:
  /// Adds the samples of one ping: `samples` numbers of `width` bytes (2 or 4).
  void take(const RecordingBytes& bytes, std::size_t samples, std::size_t width, bool is_float);
  /// Whether the highest byte is first. Whole numbers: neighbouring samples are alike, so the
  /// highest byte of a sample changes slowly and has few values. The highest byte is first if the
  /// first byte has a lower entropy than the last byte, and the first byte changes more slowly or
  /// is always small. Floats: the highest byte is first if more than a tenth of the numbers as
  /// stored are absurd (above 1e20, or nearer to 0 than 1e-20), and less than a hundredth with
  /// reversed bytes.
  bool is_exchanged() const;

 private:
  struct ByteSigns {
    std::array<double, 256> counts{};
    double steps = 0.0, change = 0.0;  // steps from sample to sample; the sum of their sizes
    void take(std::uint8_t byte) { counts[byte] += 1.0; }
    double entropy() const;
    /// The mean change from sample to sample, divided by the mean change of bytes that are drawn at
    /// random with the same frequencies; 1 if all bytes are equal.
    double roughness() const;
  };
  ByteSigns low_, high_;
  double floats_ = 0.0, absurd_ = 0.0, absurd_exchanged_ = 0.0;
};

}  // namespace ensonify::engine
