#pragma once

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// How much of a bright sample is left in the pings before and after it: the mean of the
/// neighbours' excess over the mean of their block, over the sample's own excess. Bright is what
/// exceeds 4 times the mean of its block (8 pings x 16 samples) at 8 to 20 degrees of grazing
/// angle. A point of the bed lasts for as many pings as have it in their beams; noise and other
/// causes of single bright samples do not. NaN with fewer than 30 such samples.
double lasting_peaks(const RecordedLine& line);

}  // namespace ensonify::engine
