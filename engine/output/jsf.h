#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <ensonify/engine/output/recording.h>

namespace ensonify::engine {

/// Bytes of the header of each message, and of the second header in a message of samples.
constexpr std::size_t jsf_message_header = 16, jsf_sonar_header = 240;

/// Subsystems 20 to 39 are sidescan sonars.
constexpr std::size_t max_sonars_of_jsf = 20;

/// Why JSF cannot hold a ping of this time with samples this long, and what to do; empty if it can.
std::string fault_of_jsf(std::int64_t unix_ms, double sample_s);

/// The recordings of one run's sonars as EdgeTech JSF (EdgeTech, description of the JSF file
/// format, 990-0000048). Each ping of each sonar has one message 80 (envelope data) per side, with
/// samples from near to far, as integers with weighting factor 0. The position is marked as the
/// position of the sonar ("position interpolated"). The sonars of a scene are subsystems 20, 21,
/// ... in order of rising frequency. A message has no field for a time-varied gain, so the
/// annotation has the received levels (dB re 1 uPa) at full scale in the nearest and in the
/// farthest sample. A message has no field for the ping interval, but the times of the messages
/// show it, and the number of pulses in the water is computed from it. The recordings must have the
/// same pings. Throws std::invalid_argument for none or more than max_sonars_of_jsf recordings, and
/// std::runtime_error with fault_of_jsf().
std::vector<std::byte> encode_jsf(std::span<const Recording> sonars);

}  // namespace ensonify::engine
