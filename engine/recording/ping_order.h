#pragma once

#include <string_view>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// Leaves out repeated pings, with a warning: pings with the number, beam, time, range and samples
/// of an earlier ping. A ping stays if it has neither number nor time, or if all its samples are 0.
void leave_out_repeated(RecordedLine& line, std::string_view name);

/// Sorts the pings by number, with a warning, if their times do not ascend but do ascend after
/// sorting. If they do not ascend even then, a clock was set, and the order stays.
void put_in_order(RecordedLine& line, std::string_view name);

}  // namespace ensonify::engine
