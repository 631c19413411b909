#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/engine/output/recording.h>

namespace ensonify::engine {

/// A recording as EdgeTech JSF (EdgeTech, description of the JSF file format, 990-0000048): message 80, a sonar's
/// envelope, for each side of each ping that it has, near to far on both sides, as integers of weighting factor 0.
/// Throws std::invalid_argument without pings.
std::vector<std::byte> encode_jsf(const Recording& recording);

}  // namespace ensonify::engine
