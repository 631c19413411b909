#include <ensonify/engine/output/rle_lines.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <stdexcept>

namespace ensonify::engine {
namespace {

constexpr std::size_t longest_run = 128, longest_copy = 127;
constexpr std::size_t word_bits = 64;

// The loops over bytes use no members, so that compilers can vectorise them.

void split_bytes(const std::byte* from, std::size_t pairs, std::uint8_t* even, std::uint8_t* odd) {
  for (std::size_t i = 0; i < pairs; ++i) {
    even[i] = std::to_integer<std::uint8_t>(from[2 * i]);
    odd[i] = std::to_integer<std::uint8_t>(from[2 * i + 1]);
  }
}

void take_steps(const std::uint8_t* values, std::size_t count, std::uint8_t* steps) {
  steps[0] = values[0];
  for (std::size_t i = 1; i < count; ++i)
    steps[i] = static_cast<std::uint8_t>(values[i] - values[i - 1] + 128);
}

/// Sets the bits of steps that equal the next two steps. Reads two steps beyond the last word.
void mark_repeated(const std::uint8_t* steps, std::span<std::uint64_t> marks) {
  for (std::uint64_t& word : marks) {
    std::array<std::uint8_t, word_bits> equal;
    for (std::size_t i = 0; i < word_bits; ++i)
      equal[i] = static_cast<std::uint8_t>((steps[i] == steps[i + 1]) & (steps[i] == steps[i + 2]));
    word = 0;
    for (std::size_t i = 0; i < word_bits; i += 8) {
      std::uint64_t eight;
      std::memcpy(&eight, &equal[i], 8);
      word |= (eight * 0x0102040810204080u) >> 56 << i;  // gathers the lowest bits of eight bytes
    }
    steps += word_bits;
  }
}

/// The first place from `begin` on whose bit is `set`; `end` if there is none before `end`.
template <bool set>
std::size_t find_bit(std::span<const std::uint64_t> bits, std::size_t begin, std::size_t end) {
  std::size_t place = begin;
  while (place < end) {
    const std::uint64_t word = bits[place / word_bits];
    const std::uint64_t left = (set ? word : ~word) >> place % word_bits;
    if (left != 0) return std::min(place + static_cast<std::size_t>(std::countr_zero(left)), end);
    place = (place / word_bits + 1) * word_bits;
  }
  return end;
}

}  // namespace

RleLines::RleLines(std::size_t line_bytes)
    : bytes_(line_bytes),
      split_(bytes_),
      // There is room behind the line for whole words of bits, and for copies of fixed length.
      steps_(bytes_ + std::max(word_bits + 2, longest_copy)),
      repeated_((bytes_ + word_bits - 1) / word_bits),
      packed_(bytes_ + bytes_ / longest_copy + 1 + longest_copy + 1) {
  if (bytes_ == 0 || bytes_ % 2 != 0)
    throw std::invalid_argument("RleLines: not an even number of bytes");
}

void RleLines::add(std::span<const std::byte> values) {
  if (values.size() % 2 != 0 || values.size() > bytes_ - added_)
    throw std::invalid_argument("RleLines: the values do not fit the line");
  std::uint8_t* even = split_.data() + added_ / 2;
  split_bytes(values.data(), values.size() / 2, even, even + bytes_ / 2);
  added_ += values.size();
}

std::span<const std::byte> RleLines::pack() {
  if (added_ != bytes_) throw std::invalid_argument("RleLines: the line is not complete");
  added_ = 0;
  take_steps(split_.data(), bytes_, steps_.data());
  // The step behind the line differs from the last, so that no run continues behind the line.
  steps_[bytes_] = static_cast<std::uint8_t>(~steps_[bytes_ - 1]);
  mark_repeated(steps_.data(), repeated_);

  const std::uint8_t* steps = steps_.data();
  std::uint8_t* to = packed_.data();
  std::size_t place = 0;
  while (place < bytes_) {
    const std::size_t run_end = find_bit<false>(repeated_, place, place + longest_run - 2);
    if (run_end > place) {
      const std::size_t length = run_end + 2 - place;
      *to++ = static_cast<std::uint8_t>(length - 1);
      *to++ = steps[place];
      place += length;
    } else {
      const std::size_t end =
          find_bit<true>(repeated_, place + 1, std::min(place + longest_copy, bytes_));
      *to++ = static_cast<std::uint8_t>(place - end);
      std::memcpy(to, steps + place, longest_copy);  // a fixed length is faster
      to += end - place;
      place = end;
    }
  }
  const auto length = static_cast<std::size_t>(to - packed_.data());
  if (length < bytes_) return std::as_bytes(std::span(packed_).first(length));
  for (std::size_t i = 0; i < bytes_ / 2; ++i) {
    packed_[2 * i] = split_[i];
    packed_[2 * i + 1] = split_[bytes_ / 2 + i];
  }
  return std::as_bytes(std::span(packed_).first(bytes_));
}

}  // namespace ensonify::engine
