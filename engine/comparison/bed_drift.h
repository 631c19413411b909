#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// How much farther from the sonar the same bed lies in each ping than in the one before, metres:
/// the shift at which the texture of neighbouring pings [first, end) of one side is most alike, by
/// the peak of their correlation. Only samples below 30 degrees of grazing count, where the bed
/// begins at `bed` (find_bed()). Unset if neighbouring pings are not alike, or without a range.
std::optional<double> bed_drift_m(const RecordedLine& line, Side side,
                                  std::span<const std::size_t> bed, std::size_t first,
                                  std::size_t end);

/// From the drifts of both sides: how far the bed moves from port to starboard per ping, in range,
/// as seen from a vehicle that does not move along its heading.
std::optional<double> sideways_drift_m(std::optional<double> port_m,
                                       std::optional<double> starboard_m);

}  // namespace ensonify::engine
