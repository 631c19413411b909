#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>

namespace ensonify::engine {

/// Whether a number can be the speed of sound in water, m/s.
inline bool is_sound_speed(double speed_mps) { return speed_mps >= 1300.0 && speed_mps <= 1700.0; }

/// Reads values of a packed little-endian format at given offsets.
class RecordingBytes {
 public:
  explicit RecordingBytes(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::size_t size() const { return bytes_.size(); }
  /// The bytes from `offset` on, at most `size` of them.
  RecordingBytes part(std::size_t offset, std::size_t size = static_cast<std::size_t>(-1)) const {
    if (offset > bytes_.size()) offset = bytes_.size();
    return RecordingBytes(bytes_.subspan(offset, std::min(size, bytes_.size() - offset)));
  }
  bool has(std::size_t offset, std::size_t size) const {
    return offset <= bytes_.size() && size <= bytes_.size() - offset;
  }
  /// The value at `offset`; 0 if it does not lie within the bytes.
  template <class T>
  T at(std::size_t offset) const {
    static_assert(std::is_arithmetic_v<T>);
    T value{};
    if (has(offset, sizeof value)) std::memcpy(&value, bytes_.data() + offset, sizeof value);
    return value;
  }
  /// The number at `offset`, for fields in which 0 means "unknown": unset if it is 0 or not finite.
  template <class T>
  std::optional<double> known(std::size_t offset) const {
    const double value = static_cast<double>(at<T>(offset));
    if (value == 0.0 || !std::isfinite(value)) return std::nullopt;
    return value;
  }
  /// A text field, up to its first zero byte. All but printable ASCII characters become '?'.
  std::string text(std::size_t offset, std::size_t width) const {
    std::string text;
    for (std::size_t i = 0; i < width && has(offset + i, 1); ++i) {
      const char c = at<char>(offset + i);
      if (c == '\0') break;
      text += c >= ' ' && c <= '~' ? c : '?';
    }
    return text;
  }

 private:
  std::span<const std::byte> bytes_;
};

}  // namespace ensonify::engine
