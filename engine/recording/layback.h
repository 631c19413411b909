#pragma once

#include <optional>
#include <string_view>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// How far a sonar is towed behind the ship, metres over ground, from what its pings state: the
/// layback itself; without it, that of a straight cable of this length. Unset if it is neither
/// stated nor less than 10 km.
std::optional<double> stated_layback_m(double layback_m, double cable_m, double sonar_depth_m);

/// Moves the places of pings that have a layback, which are those of the ship, back to the towed
/// sonar: to where the ship was when it was as far away as the layback. Before the line, the ship
/// is taken to come straight from behind. Adds a warning that says so. If the ship does not move,
/// the places stay, and the pings have no layback.
void tow_back(RecordedLine& line, std::string_view name);

}  // namespace ensonify::engine
