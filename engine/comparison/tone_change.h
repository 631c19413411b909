#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// The size of the blocks in which the bed is described.
constexpr std::size_t block_pings = 8, block_samples = 16;

/// The numbers of pings between two blocks whose levels are compared.
constexpr std::array<std::size_t, 3> tone_lags{8, 32, 128};

/// Appends, for each lag, the squared changes of level (dB^2) between blocks at the same range that
/// are this number of pings apart, for the pings [first, end) of one side. `bed` is the first
/// sample of the bed in each ping (find_bed()). Blocks with water or only zeros are left out.
void add_tone_changes(const RecordedLine& line, Side side, std::span<const std::size_t> bed,
                      std::size_t first, std::size_t end,
                      std::array<std::vector<double>, tone_lags.size()>& squares_db2);

}  // namespace ensonify::engine
