#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// A line with the pings `indices` of `line`. The rows keep their length.
RecordedLine some_pings(const RecordedLine& line, const std::vector<std::size_t>& indices);

/// Cuts the rows of a line to this length, or fills them up with 0.
void set_samples(RecordedLine& line, std::size_t samples);

/// Pings of one range and length, so that sample k of each ping lies at the same range.
struct AlikePings {
  RecordedLine line;     ///< the rows are as long as the pings
  std::string left_out;  ///< says what was left out; empty: nothing
};
/// The pings that have the line's most frequent combination of range (within 1 %) and length. If
/// two combinations are equally frequent, the one with the earliest ping is taken. If most pings
/// state no range, the pings without a range are taken instead. Where one side of a ping ends at a
/// shorter range, the other side is cut there.
AlikePings alike_pings(RecordedLine line);

}  // namespace ensonify::engine
