#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/engine/output/recording.h>

namespace ensonify::engine {

/// A recording as EdgeTech JSF (EdgeTech, description of the JSF file format, 990-0000048):
/// message 80, a sonar's envelope, for each side of each ping that it has, near to far on both
/// sides, as integers of weighting factor 0. The place is marked as the sonar's own ("position
/// interpolated"). Sonars of a scene have subsystems 20, 21, ... from the lowest frequency on.
std::vector<std::byte> encode_jsf(const Recording& recording);

}  // namespace ensonify::engine
