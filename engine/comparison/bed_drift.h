#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// How much farther from the sonar, in metres, the same bed lies in a ping than in the ping before.
/// This is the shift at the peak of the correlation between neighbouring pings of one side. Only
/// pings [first, end) and samples with a grazing angle below 30 degrees are used. `bed` is the
/// first sample of the bed in each ping (find_bed()). Unset if neighbouring pings do not correlate,
/// or if the line states no range.
std::optional<double> bed_drift_m(const RecordedLine& line, Side side,
                                  std::span<const std::size_t> bed, std::size_t first,
                                  std::size_t end);

/// The largest correlation of pings that are `lag` pings apart, divided by the largest correlation
/// of neighbouring pings. It uses the same pings and samples as bed_drift_m(). It is small for
/// speckle and single stones, which only a few pings show. It is large for ripples and other long
/// forms; if these are oblique to the track, they shift from ping to ping as the bed does under a
/// vehicle with a crab angle. Not finite if there are too few pings or samples for bed_drift_m().
double lasting_likeness(const RecordedLine& line, Side side, std::span<const std::size_t> bed,
                        std::size_t first, std::size_t end, std::size_t lag);

/// How far the bed moves from port to starboard per ping, in metres of range, from the drifts of
/// both sides. It is 0 for a vehicle that moves along its heading. Unset if a drift is unset.
std::optional<double> sideways_drift_m(std::optional<double> port_m,
                                       std::optional<double> starboard_m);

}  // namespace ensonify::engine
