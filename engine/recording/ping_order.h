#pragma once

#include <string_view>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// Leaves out pings that the file has twice: with the number, beam, time, range and samples of an
/// earlier one. A ping without a number and time, or without an echo, stays. Adds a warning.
void leave_out_repeated(RecordedLine& line, std::string_view name);

/// Sorts the pings by number if their times then ascend and did not before. Otherwise a clock was
/// set, and the order stays. Adds a warning.
void put_in_order(RecordedLine& line, std::string_view name);

}  // namespace ensonify::engine
