#pragma once

#include <cstdint>
#include <limits>

namespace ensonify::refine {

/// The number of a vertex, a face, a corner or a half-edge.
using Index = std::uint32_t;
inline constexpr Index none = std::numeric_limits<Index>::max();

/// Packs two numbers into one, so that packed numbers are in the order of `high`, then of `low`.
constexpr std::uint64_t pack(Index high, Index low) { return std::uint64_t{high} << 32 | low; }

}  // namespace ensonify::refine
