#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <ensonify/engine/output/recording.h>

namespace ensonify::engine {

/// A sonar has two channels, and a file header without extensions describes six.
constexpr std::size_t max_sonars_of_xtf = 3;

/// The recordings of one run's sonars as eXtended Triton Format (Triton Imaging, XTF file format,
/// rev. 41): the file header, and for each ping a sonar packet with two channels per sonar (port
/// from far to near, starboard from near to far), 16 bits per sample. A packet has one position and
/// attitude, so sonars with different mountings have separate packets for a ping. If the file has
/// several sonars, the channels have the sonars' names. Fields whose use is not evident:
/// SoundVelocity is half the sound speed and SecondsPerPing is the two-way time of the range, as
/// other recorders write them; FixedVSOP is the distance between pings, cm; InitialGainCode and
/// GainCode are the received levels (dB re 1 uPa) at full scale in the nearest and in the farthest
/// sample; BandWidth is in kHz. The recordings must have the same pings. Throws
/// std::invalid_argument for none or more than max_sonars_of_xtf recordings.
std::vector<std::byte> encode_xtf(std::span<const Recording> sonars);

}  // namespace ensonify::engine
