#pragma once

#include <optional>
#include <string_view>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// How far a sonar is towed behind the ship, in metres over ground. It is the stated layback. If
/// none is stated (not positive), it follows from a straight cable of length `cable_m` to the
/// sonar's depth. Unset if the result is not positive or not less than 10 km.
std::optional<double> stated_layback_m(double layback_m, double cable_m, double sonar_depth_m);

/// For pings that have a layback, the places are those of the ship. This moves them to the towed
/// sonar: to the place on the ship's track whose distance from the ship is the layback. The track
/// is continued backwards in a straight line before the first ping. Adds a warning. If the ship
/// does not move, the places stay, the laybacks are removed, and the warning says so.
void tow_back(RecordedLine& line, std::string_view name);

}  // namespace ensonify::engine
