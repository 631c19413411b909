#pragma once

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <vector>

namespace ensonify::engine {

static_assert(std::endian::native == std::endian::little,
              "values are copied unchanged into little-endian formats");

/// Writes values of a packed little-endian format at given offsets. All other bytes are 0.
class PackedBytes {
 public:
  explicit PackedBytes(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  /// Begins a header or packet of `size` bytes; offsets count from its start.
  void begin(std::size_t size) {
    start_ = bytes_.size();
    bytes_.resize(start_ + size);
  }
  /// Writes a number as a T.
  template <class T, class Number>
  void put(std::size_t offset, Number number) {
    const auto value = static_cast<T>(number);
    std::memcpy(bytes_.data() + start_ + offset, &value, sizeof value);
  }
  /// Writes a text into a field of `width` bytes. Cuts the text if it is too long: C programs need
  /// a zero byte at the end of the field.
  void text(std::size_t offset, std::size_t width, std::string_view value) {
    std::memcpy(bytes_.data() + start_ + offset, value.data(), std::min(value.size(), width - 1));
  }
  void samples(std::size_t offset, std::span<const std::uint16_t> values) {
    std::memcpy(bytes_.data() + start_ + offset, values.data(), values.size_bytes());
  }

 private:
  std::vector<std::byte>& bytes_;
  std::size_t start_ = 0;
};

/// A time as a calendar date and time of day, UTC.
struct CalendarTime {
  int year = 1970, month = 1, day = 1, day_of_year = 1, hour = 0, minute = 0, second = 0, ms = 0;
  std::int64_t ms_of_day = 0;
};

inline CalendarTime calendar_time(std::int64_t unix_ms) {
  using namespace std::chrono;
  const sys_time<milliseconds> moment{milliseconds(unix_ms)};
  const sys_days date = floor<days>(moment);
  const year_month_day ymd{date};
  const hh_mm_ss time{moment - date};
  return {.year = static_cast<int>(ymd.year()),
          .month = static_cast<int>(static_cast<unsigned>(ymd.month())),
          .day = static_cast<int>(static_cast<unsigned>(ymd.day())),
          .day_of_year = static_cast<int>((date - sys_days(ymd.year() / January / 1)).count()) + 1,
          .hour = static_cast<int>(time.hours().count()),
          .minute = static_cast<int>(time.minutes().count()),
          .second = static_cast<int>(time.seconds().count()),
          .ms = static_cast<int>(time.subseconds().count()),
          .ms_of_day = (moment - date).count()};
}

}  // namespace ensonify::engine
