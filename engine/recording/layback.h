#pragma once

#include <string_view>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// For pings that have a layback, the places are those of the ship. This moves them to the towed
/// sonar: to the place on the ship's track whose distance from the ship is the layback. The track
/// is continued backwards in a straight line before the first ping. Adds a warning. If the ship
/// does not move, the places stay, the laybacks are removed, and the warning says so.
void tow_back(RecordedLine& line, std::string_view name);

}  // namespace ensonify::engine
