#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// How much farther from the sonar, in metres, the same bed lies in each ping than in the ping
/// before: the shift at the peak of the correlation between neighbouring pings of one side. Only
/// pings [first, end) and samples below 30 degrees of grazing angle count. `bed` is where the bed
/// begins in each ping (find_bed()). Unset if neighbouring pings do not correlate, or if the line
/// states no range.
std::optional<double> bed_drift_m(const RecordedLine& line, Side side,
                                  std::span<const std::size_t> bed, std::size_t first,
                                  std::size_t end);

/// How alike pings are that are `lag` pings apart, over how alike neighbours are: the ratio of the
/// peaks of their correlations, of the same pings and samples as in bed_drift_m(). Speckle and
/// single stones are seen by few pings. Ripples and other long forms stay, and where they are
/// oblique to the track they move sideways as the bed under a crabbing vehicle does. Not finite
/// where bed_drift_m() is unset for want of pings or samples.
double lasting_likeness(const RecordedLine& line, Side side, std::span<const std::size_t> bed,
                        std::size_t first, std::size_t end, std::size_t lag);

/// How far the bed moves from port to starboard per ping, in range (m), from the drifts of both
/// sides. It is 0 for a vehicle that moves along its heading.
std::optional<double> sideways_drift_m(std::optional<double> port_m,
                                       std::optional<double> starboard_m);

}  // namespace ensonify::engine
