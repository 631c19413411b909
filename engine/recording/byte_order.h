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
  /// Whole numbers: from sample to sample the high byte changes less than a byte drawn at random
  /// from the file, because of range and pulse, and it has fewer values. So they are exchanged if
  /// the byte that should be low does so, and the one that should be high does not, or if the
  /// former is always small, whatever the latter is. Floats: exchanged, few of them lie beyond 1e20
  /// or within 1e-20.
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
