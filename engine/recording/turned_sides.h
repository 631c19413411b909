#pragma once

#include <string_view>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// Turns the samples of a side that the file has from far to near where its format says near to
/// far, or the reverse, and adds a warning. The samples show it: nearest to the sonar is the water
/// column, dark up to the sharp edge of the bed. A side is turned if at least half of its pings
/// have such an edge from the far end on and not from the near end, and at most a third as many
/// have it as it should be. Lines whose sides end at different ranges are left as they are.
void turn_reversed_sides(RecordedLine& line, std::string_view name);

}  // namespace ensonify::engine
