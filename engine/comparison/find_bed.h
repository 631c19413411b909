#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

constexpr std::size_t bed_found_early = 2;  ///< because means over 5 samples are searched

/// Where the bed begins in the pings of one side.
struct FoundBed {
  /// By ping: the first sample of the bed, bed_found_early samples before its edge; 0 where all is
  /// bed, the number of samples in a silent ping.
  std::vector<std::size_t> first_sample;
  bool stated = false;  ///< the samples do not show it well: it is where the pings' altitudes are
};

/// Finds the bottom line. Wherever the samples of a ping rise above the geometric mean of the water
/// column and the bed for 8 samples, bed may be; it begins before, where they leave the water
/// column, because a beam that looks away from the nadir receives the nearest bed only weakly.
/// Noise that grows with range, as a time-varied gain makes it, does not count as bed. Of
/// these places (fish and noise make some too) the line takes those that follow each other from
/// ping to ping, those with less echo before them, and those at the stated altitude. That altitude
/// counts only if it lies by the same distance from such a place in half of the pings; the distance
/// may be any. Pings that the line leaves out are interpolated, or lie by that distance from their
/// stated altitude. If the samples of most pings show no bed, the stated altitude counts as it is;
/// and so it does if the line lies far behind it, but the samples behind it are brighter, on the
/// mean, than those before.
FoundBed find_bed(const RecordedLine& line, Side side);

}  // namespace ensonify::engine
