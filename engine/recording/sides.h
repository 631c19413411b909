#pragma once

#include <string_view>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// Whether port and starboard of one sonar can have these frequencies. True if one is 0 (not
/// stated). Otherwise they may differ by up to 20 %: some sonars transmit at a different frequency
/// on each side, so that neither side receives the pulse of the other. The two bands of a
/// dual-frequency sonar differ by much more.
bool may_be_of_one_sonar(double port_hz, double starboard_hz);

/// Whether one of the two lines is the port side and the other line the starboard side of one
/// sonar. (Some recorders write the sides to two files.) This is so if each line has one side,
/// may_be_of_one_sonar() accepts the frequencies, and at least half of the shorter line's pings
/// have the number, beam and time (within a second) of a ping in the other line.
bool are_sides_of_one(const RecordedLine& line, const RecordedLine& other);

/// Adds the pings of `other` to `line`; are_sides_of_one() must be true. Adds a warning; `name` is
/// the file of `other`. A ping that only one of the lines has gets zeros on the other side.
void join_sides(RecordedLine& line, const RecordedLine& other, std::string_view name);

/// Reverses the samples of each side that the file stores in the wrong order (far to near instead
/// of near to far, or the opposite), and adds a warning. The samples show the order: the water
/// column is nearest to the sonar and dark, up to the sharp edge of the bed. The pings are examined
/// in blocks of 8. A side is reversed if at least half of its blocks have such an edge only when
/// they are read from their far end, and at most a third as many blocks have a sharper edge from
/// their near end. Lines whose sides end at different ranges are not changed.
void turn_reversed_sides(RecordedLine& line, std::string_view name);

}  // namespace ensonify::engine
