#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

// Each takes the bytes of a file; `name` stands for it in messages. They throw RecordingError.

/// eXtended Triton Format (Triton Imaging, XTF file format, rev. 41): packets of type 0 with their
/// channels. Channels of port and starboard that state the same frequency are one line; if several
/// do, those with as many samples, in the order of the header. Port is stored far to near. Position
/// and attitude of zeros are unset; a sound speed below 1000 m/s is half of it.
std::vector<RecordedLine> parse_xtf(std::span<const std::byte> bytes, std::string_view name);
bool is_xtf(std::span<const std::byte> begin);

/// EdgeTech's JSF: messages of type 80 (envelope or analytic) of the sidescan subsystems 20 to 39,
/// each as one line. Navigation is read where the pings' flags state that it is valid; where it is
/// plausible, with a warning, if no ping has any flag (files of before 2008).
std::vector<RecordedLine> parse_jsf(std::span<const std::byte> bytes, std::string_view name);
bool is_jsf(std::span<const std::byte> begin);

}  // namespace ensonify::engine
