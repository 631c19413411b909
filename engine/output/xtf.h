#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/engine/output/recording.h>

namespace ensonify::engine {

/// A recording as eXtended Triton Format (Triton Imaging, XTF file format, rev. 41): the file header, and
/// a sonar packet a ping with both channels, port far..near and starboard near..far, 16 bits a sample.
/// SoundVelocity is half the sound speed, as recorders write it. Throws std::invalid_argument without pings.
std::vector<std::byte> encode_xtf(const Recording& recording);

}  // namespace ensonify::engine
