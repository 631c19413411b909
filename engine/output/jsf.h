#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/engine/output/recording.h>

namespace ensonify::engine {

/// A recording as EdgeTech JSF (EdgeTech, description of the JSF file format, 990-0000048): one
/// message 80 (envelope data) per ping and side, near to far on both sides, as integers with
/// weighting factor 0. The position is marked as the sonar's own ("position interpolated"). The
/// sonars of a scene are subsystems 20, 21, ... in order of rising frequency.
std::vector<std::byte> encode_jsf(const Recording& recording);

}  // namespace ensonify::engine
