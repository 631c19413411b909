#pragma once

#include <cstddef>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include <ensonify/engine/image/line_layout.h>
#include <ensonify/engine/recording/recorded_line.h>
#include <ensonify/engine/sonar/instrument/sonar.h>

namespace ensonify::engine {

/// Appends rows of a run's image.
template <class Value>
void add_image_rows(Sides sides, const std::vector<Value>& values, std::size_t rows,
                    RecordedLine& line) {
  const LineLayout layout(sides, line.samples);
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t sector = 0; sector < layout.sectors(); ++sector)
      layout.get(sector, values.begin() + static_cast<std::ptrdiff_t>(row * layout.columns()),
                 std::back_inserter(layout.mirrored(sector) ? line.port : line.starboard));
}

/// A line of a recording (XTF, JSF; its alike_pings(), with a warning if there are others), of a
/// run's folder (its layer `sample`, as the sonar recorded it, or its recordings if it has no EXR),
/// or of a folder of pictures (line_of_pictures()). `sonar` chooses among several: a run's sonar by
/// its name, a recording's line by its number from 1; empty: the only one. Throws RecordingError or
/// SceneError for what cannot be read and for a choice that is not there.
RecordedLine read_line(const std::filesystem::path& place, const std::string& sonar);

/// The files that read_line() may read at a place. Throws std::filesystem::filesystem_error for a
/// folder that cannot be read.
std::vector<std::filesystem::path> files_of_line(const std::filesystem::path& place);

}  // namespace ensonify::engine
