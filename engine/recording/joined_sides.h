#pragma once

#include <string_view>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// Whether port and starboard of one sonar can have these frequencies; 0: not stated. They may
/// differ by some percent, so that the sides do not receive each other. Two frequencies of one
/// sonar differ much more.
bool may_be_of_one_sonar(double port_hz, double starboard_hz);

/// Whether one line is the port and the other the starboard of one sonar, as some recorders write
/// them to two files: half of the shorter one's pings or more have number, beam and time (within a
/// second) of a ping of the other, and the frequencies may be those of one sonar.
bool are_sides_of_one(const RecordedLine& line, const RecordedLine& other);

/// Joins `other`, for which are_sides_of_one(), to a line. Adds a warning; `name` is the other's
/// file. A ping that one of them lacks has no samples on that side.
void join_sides(RecordedLine& line, const RecordedLine& other, std::string_view name);

}  // namespace ensonify::engine
