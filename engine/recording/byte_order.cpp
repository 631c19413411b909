#include <ensonify/engine/recording/byte_order.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <numeric>

namespace ensonify::engine {
namespace {

/// Whether a float with these bits cannot be an amplitude.
bool is_absurd(std::uint32_t bits) {
  const float value = std::abs(std::bit_cast<float>(bits));
  return value != 0.0f && !(value > 1e-20f && value < 1e20f);
}

}  // namespace

double ByteOrder::ByteSigns::entropy() const {
  const double number = std::accumulate(counts.begin(), counts.end(), 0.0);
  double bits = 0.0;
  for (const double count : counts)
    if (count > 0.0) bits -= count / number * std::log2(count / number);
  return bits;
}

double ByteOrder::ByteSigns::roughness() const {
  const double number = std::accumulate(counts.begin(), counts.end(), 0.0);
  // For independent a and b, E|a - b| is the sum of 2 F (1 - F) over the distribution function F.
  double below = 0.0, at_random = 0.0;
  for (const double count : counts) {
    below += count / number;
    at_random += 2.0 * below * (1.0 - below);
  }
  constexpr double none = 1e-9;
  return at_random > none && steps > 0.0 ? change / steps / at_random : 1.0;
}

void ByteOrder::take(const RecordingBytes& bytes, std::size_t samples, std::size_t width,
                     bool is_float) {
  bool has_before = false;
  int low_before = 0, high_before = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    const std::size_t at = i * width;
    if (is_float) {
      const auto bits = bytes.at<std::uint32_t>(at);
      floats_ += 1.0;
      absurd_ += is_absurd(bits);
      absurd_exchanged_ +=
          is_absurd(bits << 24 | (bits & 0xff00u) << 8 | (bits >> 8 & 0xff00u) | bits >> 24);
      continue;
    }
    const auto low = bytes.at<std::uint8_t>(at), high = bytes.at<std::uint8_t>(at + width - 1);
    const bool silent = low == 0 && high == 0;  // samples without an echo show no byte order
    if (!silent) {
      low_.take(low);
      high_.take(high);
      if (has_before) {
        low_.steps += 1.0;
        high_.steps += 1.0;
        low_.change += std::abs(low - low_before);
        high_.change += std::abs(high - high_before);
      }
    }
    has_before = !silent;
    low_before = low;
    high_before = high;
  }
}

bool ByteOrder::is_exchanged() const {
  if (floats_ > 0.0) return absurd_ > 0.1 * floats_ && absurd_exchanged_ < 0.01 * floats_;
  constexpr double fewest = 4096.0, clearly = 0.9;
  if (!(low_.steps > fewest && high_.entropy() > low_.entropy())) return false;
  if (low_.roughness() < clearly * high_.roughness()) return true;
  // Faint samples: the first byte is always small, but not always 0. So it is the highest byte.
  constexpr std::size_t small = 32;
  constexpr double seldom = 1e-3;  // of the samples
  const auto number_from = [&](std::size_t first) {
    return std::accumulate(low_.counts.begin() + static_cast<std::ptrdiff_t>(first),
                           low_.counts.end(), 0.0);
  };
  return number_from(small) == 0.0 && number_from(1) > seldom * number_from(0);
}

}  // namespace ensonify::engine
