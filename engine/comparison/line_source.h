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

/// Appends the first `rows` rows of an image of a run, with the columns of `sides`, to a line. The
/// line's `samples` must be set.
template <class Value>
void add_image_rows(Sides sides, const std::vector<Value>& values, std::size_t rows,
                    RecordedLine& line) {
  const LineLayout layout(sides, line.samples);
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t sector = 0; sector < layout.sectors(); ++sector)
      layout.get(sector, values.begin() + static_cast<std::ptrdiff_t>(row * layout.columns()),
                 std::back_inserter(layout.mirrored(sector) ? line.port : line.starboard));
}

/// Reads a line from one of three kinds of places. From a recording (XTF, JSF) it takes the
/// alike_pings(), with a warning if there are other pings. From a run's folder it takes the layer
/// `sample`, or the run's recordings if the run has no EXR. From a folder of pictures it takes
/// line_of_pictures(). `sonar` chooses one of several: a sonar of a run by its name, a line of a
/// recording by its number from 1; empty: there is only one. Throws RecordingError or SceneError if
/// the place cannot be read or `sonar` is not in it.
RecordedLine read_line(const std::filesystem::path& place, const std::string& sonar);

/// The files that read_line() may read at a place. Throws std::filesystem::filesystem_error if the
/// place is a folder that cannot be read.
std::vector<std::filesystem::path> files_of_line(const std::filesystem::path& place);

}  // namespace ensonify::engine
