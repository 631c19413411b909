#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// The bed is described in blocks.
constexpr std::size_t block_pings = 8, block_samples = 16;

/// Pings between two blocks whose levels are compared.
constexpr std::array<std::size_t, 3> tone_lags{8, 32, 128};

/// Appends, for each lag, the squared changes of level, dB^2, from each block of one side's pings
/// [first, end) to that of the lag later, at the same range. The bed begins at `bed`
/// (find_bed()), and blocks that have water or silence are left out.
void add_tone_changes(const RecordedLine& line, Side side, std::span<const std::size_t> bed,
                      std::size_t first, std::size_t end,
                      std::array<std::vector<double>, tone_lags.size()>& squares_db2);

}  // namespace ensonify::engine
