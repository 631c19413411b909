#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>
#include <ensonify/refine/error.h>

namespace ensonify::engine {

/// A fault in a recording: `file: what is wrong, what was expected`.
struct RecordingError : Error {
  using Error::Error;
};

/// Whether a file begins as an XTF or JSF recording does.
bool is_recording(const std::filesystem::path& file);

/// Reads the sidescan channels of an XTF or JSF recording: a line for each sonar or frequency, in
/// the file's order. Both sides of a ping are in one line. Damaged or unknown packets are skipped,
/// with a warning. If the file ends within a packet, this packet is left out, with a warning. A
/// side whose samples are in the wrong order is reversed (turn_reversed_sides()). Takes about three
/// times the memory of the file. Throws RecordingError if the file cannot be read, has another
/// format, or has no sidescan samples; throws std::bad_alloc.
std::vector<RecordedLine> read_recording(const std::filesystem::path& file);

/// Reads several files of one recording, in the given order, as one recording. Rows are as long as
/// the longest ping. If a file has the other side of the pings in an earlier file, the two files
/// are joined (are_sides_of_one()). If a file begins before the end of the files before it, its
/// lines get a warning. Throws as read_recording(), and RecordingError if the files differ in
/// format or number of lines.
std::vector<RecordedLine> read_recordings(std::span<const std::filesystem::path> files);

/// As read_recording(), from the bytes of a file; `name` stands for the file in messages.
std::vector<RecordedLine> parse_recording(std::span<const std::byte> bytes, std::string_view name);

}  // namespace ensonify::engine
