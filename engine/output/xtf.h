#pragma once

#include <cstddef>
#include <vector>

#include <ensonify/engine/output/recording.h>

namespace ensonify::engine {

/// A recording as eXtended Triton Format (Triton Imaging, XTF file format, rev. 41): the file
/// header, and for each ping a sonar packet with both channels, port far..near and starboard
/// near..far, 16 bits per sample. Fields whose use is not evident: SoundVelocity is half the sound
/// speed and SecondsPerPing is the two-way time of the range, as other recorders write them;
/// FixedVSOP is the distance between pings, cm; InitialGainCode and GainCode are the received
/// levels (dB re 1 uPa) at full scale in the nearest and in the farthest sample; BandWidth is in
/// kHz.
std::vector<std::byte> encode_xtf(const Recording& recording);

}  // namespace ensonify::engine
