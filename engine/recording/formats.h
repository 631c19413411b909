#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

// Each parser takes a file's bytes and its `name` for messages, and throws RecordingError.

/// Reads eXtended Triton Format (Triton Imaging, XTF file format, rev. 41): packets of type 0 with
/// their channels. A port and a starboard channel of one frequency (may_be_of_one_sonar()) are one
/// line; if several have this frequency, those with equal numbers of samples are paired, in the
/// order of the header. Samples of port are stored from far to near. A position or attitude of
/// zeros is unset. A stated sound speed of 650 to 850 m/s is half of the sound speed.
std::vector<RecordedLine> parse_xtf(std::span<const std::byte> bytes, std::string_view name);
bool is_xtf(std::span<const std::byte> begin);

/// Reads EdgeTech's JSF: messages of type 80 (envelope or analytic) of the sidescan subsystems 20
/// to 39. Each subsystem is one line. A value of the navigation is read if the flags of its ping
/// state that the value is valid. If no ping has any flag (files from before 2008), plausible
/// values are read, with a warning.
std::vector<RecordedLine> parse_jsf(std::span<const std::byte> bytes, std::string_view name);
bool is_jsf(std::span<const std::byte> begin);

}  // namespace ensonify::engine
