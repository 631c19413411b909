#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace ensonify::refine {

// Common parts of this library's files: each has sections of whole pages, and a header that begins
// with 8 bytes, a version and the byte order.

inline constexpr std::uint64_t page_bytes = 4096;
inline constexpr std::uint32_t byte_order = 0x01020304;

inline std::uint64_t page_end(std::uint64_t bytes) {
  return (bytes + page_bytes - 1) / page_bytes * page_bytes;
}

/// The first 8 bytes of a file. Like those of PNG, they differ if the file was converted as text.
constexpr std::array<char, 8> file_magic(char a, char b, char c) {
  return {'\x89', a, b, c, '\r', '\n', '\x1a', '\n'};
}

using FileKey = std::array<char, 64>;  // padded with zeros
inline std::string_view text_of(const FileKey& key) {
  return {key.data(), static_cast<std::size_t>(std::ranges::find(key, '\0') - key.begin())};
}

}  // namespace ensonify::refine
