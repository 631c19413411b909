#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include <ensonify/refine/atomic_file.h>

namespace ensonify::tests {

/// The bytes of a file that would be written piece by piece.
inline std::vector<std::byte> written_bytes(const refine::WriteContent& write_content) {
  std::vector<std::byte> bytes;
  write_content([&](std::uint64_t place, std::span<const std::byte> piece) {
    bytes.resize(std::max(bytes.size(), place + piece.size()));
    std::ranges::copy(piece, bytes.begin() + static_cast<std::ptrdiff_t>(place));
  });
  return bytes;
}

struct NoSpace : std::runtime_error {
  NoSpace() : std::runtime_error("no space") {}
};

/// How many pieces can be the only one that does not fit without a NoSpace that reaches the caller.
/// All of them, if there are fewer than three.
inline std::size_t ignored_failures(const refine::WriteContent& write_content) {
  std::size_t pieces = 0, ignored = 0;
  write_content([&](std::uint64_t, std::span<const std::byte>) { ++pieces; });
  if (pieces < 3) return pieces;
  for (std::size_t failing = 0; failing < pieces; ++failing) {
    std::size_t piece = 0;
    try {
      write_content([&](std::uint64_t, std::span<const std::byte>) {
        if (piece++ == failing) throw NoSpace();
      });
      ++ignored;
    } catch (const NoSpace&) {
    }
  }
  return ignored;
}

}  // namespace ensonify::tests
