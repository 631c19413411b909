#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <ensonify/engine/recording/recorded_line.h>

namespace ensonify::engine {

/// A line of a recording (XTF, JSF; its alike_pings(), with a warning if there are others), of a
/// run's folder (its layer `sample`, as the sonar recorded it), or of a folder of pictures
/// (line_of_pictures()). `sonar` chooses among several: a run's sonar by its name, a recording's
/// line by its number from 1; empty: the only one. Throws RecordingError or SceneError for what
/// cannot be read and for a choice that is not there.
RecordedLine read_line(const std::filesystem::path& place, const std::string& sonar);

/// The files that read_line() may read at a place. Throws std::filesystem::filesystem_error for a
/// folder that cannot be read.
std::vector<std::filesystem::path> files_of_line(const std::filesystem::path& place);

}  // namespace ensonify::engine
