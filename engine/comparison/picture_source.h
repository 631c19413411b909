#pragma once

#include <filesystem>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// The pictures (PNG, JPEG) that a folder has itself, in the order of their names.
std::vector<std::filesystem::path> pictures_of(const std::filesystem::path& folder);

/// The pictures of a folder, in the order of their names, as one line: each is a waterfall of both
/// sides with the newest ping on top, port left and the sonar in its middle, all of one width.
/// Amplitudes are brightnesses (of colours, the mean of their channels); the range is not stated.
/// Throws RecordingError.
RecordedLine line_of_pictures(const std::filesystem::path& folder);

}  // namespace ensonify::engine
