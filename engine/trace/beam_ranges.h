#pragma once

#include <cstddef>

#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// The rays of a plane that are within the beam, or else those outside it, as ranges: calls
/// take(from, until) for each longest range [from, until) of elevations, in ascending order.
template <class Take>
void for_beam_ranges(const FanGrid& grid, std::size_t plane, bool within, const Take& take) {
  const std::size_t elevations = grid.elevation_rad.size();
  for (std::size_t from = 0, until = 0; from < elevations; from = until) {
    const bool here = grid.within_beam(plane, from);
    while (until < elevations && grid.within_beam(plane, until) == here) ++until;
    if (here == within) take(from, until);
  }
}

}  // namespace ensonify::engine
