#pragma once

#include <filesystem>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// The pictures (PNG, JPEG) directly in a folder, in the order of their names.
std::vector<std::filesystem::path> pictures_of(const std::filesystem::path& folder);

/// The pictures of a folder, in the order of their names, as one line. Each picture is a waterfall
/// of both sides with the newest ping on top, port left and the sonar in the middle. All pictures
/// have one width. The amplitude is the pixel's brightness (of a colour, the mean of its channels);
/// no range is stated. Throws RecordingError for pictures that cannot be read or differ in width.
RecordedLine line_of_pictures(const std::filesystem::path& folder);

}  // namespace ensonify::engine
