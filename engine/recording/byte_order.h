#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <ensonify/engine/recording/recording_bytes.h>

namespace ensonify::engine {

/// Finds from the samples of a channel whether their bytes are stored in the other order, the
/// highest first.
class ByteOrder {
 public:
  /// Takes `samples` numbers of `width` bytes (2 or 4), of one ping.
  void take(const RecordingBytes& bytes, std::size_t samples, std::size_t width, bool is_float);
  /// Whole numbers: neighbouring samples are alike, so the high byte of a sample changes slowly and
  /// has few values. The bytes are exchanged if the byte in the low place has fewer values than the
  /// other and either changes more slowly or is always small. Floats: the bytes are exchanged if
  /// more than a tenth of the numbers are absurd as they are (beyond 1e20, or nearer to 0 than
  /// 1e-20), and less than a hundredth after an exchange.
  bool is_exchanged() const;

 private:
  struct ByteSigns {
    std::array<double, 256> counts{};
    double steps = 0.0, change = 0.0;  // between samples, and the sum of what they change by
    void take(std::uint8_t byte) { counts[byte] += 1.0; }
    double entropy() const;
    /// The mean change from sample to sample over that of bytes drawn at random; 1 if all are
    /// equal.
    double roughness() const;
  };
  ByteSigns low_, high_;
  double floats_ = 0.0, absurd_ = 0.0, absurd_exchanged_ = 0.0;
};

}  // namespace ensonify::engine
