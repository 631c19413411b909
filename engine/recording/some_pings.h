#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// The pings `indices` of a line, as one. Its rows keep their length.
RecordedLine some_pings(const RecordedLine& line, const std::vector<std::size_t>& indices);

/// Cuts the rows of a line to this length, or fills them up with 0.
void set_samples(RecordedLine& line, std::size_t samples);

/// Pings of one range and length: sample k of each of them lies at the same range.
struct AlikePings {
  RecordedLine line;     ///< its rows are as long as its pings
  std::string left_out;  ///< says what was left out; empty: nothing
};
/// The pings that have the line's most frequent range (within 1 %) and length; of two that are
/// equally frequent, the one that comes first. If most pings state no range, only those count. A
/// ping ends where one of its sides ends.
AlikePings alike_pings(RecordedLine line);

}  // namespace ensonify::engine
