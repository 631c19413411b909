#pragma once

#include <cstddef>
#include <cstdint>

#include <ensonify/engine/trace/ray_fan.h>

namespace ensonify::engine {

/// Calls take(from, until, within) for each longest range [from, until) of a plane's elevations
/// that are all within the beam, or all outside it, in ascending order.
template <class Take>
void for_beam_ranges(const FanGrid& grid, std::size_t plane, const Take& take) {
  const std::size_t elevations = grid.elevation_rad.size();
  for (std::size_t from = 0, until = 0; from < elevations; from = until) {
    const bool within = grid.within_beam(plane, from);
    while (until < elevations && grid.within_beam(plane, until) == within) ++until;
    take(from, until, within);
  }
}

/// The number of a fan's rays that are within the beam.
inline std::uint64_t rays_within_beam(const FanGrid& grid) {
  std::uint64_t rays = 0;
  for (std::size_t plane = 0; plane < grid.planes.size(); ++plane)
    for_beam_ranges(grid, plane, [&](std::size_t from, std::size_t until, bool within) {
      if (within) rays += until - from;
    });
  return rays;
}

}  // namespace ensonify::engine
