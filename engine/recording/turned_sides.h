#pragma once

#include <string_view>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// Reverses the samples of each side that the file stores in the wrong order (far to near instead
/// of near to far, or the opposite), and adds a warning. The samples show the order: the water
/// column is nearest to the sonar and dark, up to the sharp edge of the bed. The pings are examined
/// in blocks of 8. A side is reversed if at least half of its blocks have such an edge only when
/// they are read from their far end, and at most a third as many blocks have a sharper edge from
/// their near end. Lines whose sides end at different ranges are not changed.
void turn_reversed_sides(RecordedLine& line, std::string_view name);

}  // namespace ensonify::engine
