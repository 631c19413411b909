#include <ensonify/engine/comparison/line_source.h>

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <ensonify/engine/comparison/picture_source.h>
#include <ensonify/engine/mosaic/image_reader.h>
#include <ensonify/engine/mosaic/recorded_run.h>
#include <ensonify/engine/number_in.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/recording/some_pings.h>
#include <ensonify/engine/run/output_folder.h>
#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

RecordedLine line_of_recording(const fs::path& file, const std::string& sonar) {
  std::vector<RecordedLine> lines = read_recording(file);
  std::size_t number = lines.size() == 1 && sonar.empty() ? 1 : 0;
  if (!sonar.empty()) number = number_in<std::size_t>(sonar).value_or(0);
  if (lines.size() == 1 && number != 1)
    throw RecordingError(
        fmt::format("{}: has one line, not a line '{}': leave --sonar-a or --sonar-b out",
                    file.string(), sonar));
  if (number < 1 || number > lines.size())
    throw RecordingError(fmt::format(
        "{}: {}; give --sonar-a or --sonar-b a number from 1 up to {}, see recording-info",
        file.string(),
        sonar.empty() ? fmt::format("has {} lines", lines.size())
                      : fmt::format("has no line '{}'", sonar),
        lines.size()));
  auto [line, left_out] = alike_pings(std::move(lines[number - 1]));
  if (!left_out.empty()) line.warnings.push_back(fmt::format("{}: {}", file.string(), left_out));
  return std::move(line);
}

RecordedLine line_of_run(const fs::path& folder, const std::string& sonar) {
  const RecordedRun run = read_recorded_run(folder, sonar, Positions::navigation);
  RecordedLine line{.format = "run",
                    .sonar = run.sonar.name,
                    .frequency_hz = run.sonar.frequency_hz,
                    .bandwidth_hz = run.sonar.pulse.bandwidth_hz,
                    .pulse_length_s = run.sonar.pulse.transmitted_length_s(),
                    .samples = static_cast<std::size_t>(run.sonar.bins)};
  const std::array<std::string, 1> layers{"sample"};
  std::array<std::vector<float>, 1> values;
  for (const fs::path& file : run.images) {
    ImageReader image(file);
    image.read(0, image.rows(), layers, values);
    add_image_rows(run.sonar.sides, values.front(), image.rows(), line);
  }
  for (std::size_t i = 0; i < run.pings.size(); ++i)
    line.pings.push_back({.number = i,
                          .heading_rad = run.pings[i].heading_rad,
                          .altitude_m = run.pings[i].height_m > 0.0
                                            ? std::optional(run.pings[i].height_m)
                                            : std::nullopt,
                          .range_m = run.sonar.range_m,
                          .samples = line.samples});
  const std::size_t rows = std::max(line.port.size(), line.starboard.size()) / line.samples;
  if (rows != line.pings.size())
    throw SceneError(fmt::format("{}: its images have {} pings and its tables {}; run it again",
                                 folder.string(), rows, line.pings.size()));
  return line;
}

/// Whether a folder is a run's; otherwise it has pictures.
bool is_of_run(const fs::path& folder) {
  return fs::exists(folder / "manifest.json") || pictures_of(folder).empty();
}

}  // namespace

RecordedLine read_line(const fs::path& place, const std::string& sonar) {
  if (!fs::is_directory(place)) return line_of_recording(place, sonar);
  if (!fs::exists(place / "manifest.json") && pictures_of(place).empty())
    throw RecordingError(
        place.string() +
        ": has neither the manifest.json of a run nor pictures (.png, .jpg); give the folder of a "
        "finished `ensonify run`, or of waterfall pictures");
  return is_of_run(place) ? line_of_run(place, sonar) : line_of_pictures(place);
}

std::vector<fs::path> files_of_line(const fs::path& place) {
  if (!fs::is_directory(place)) return {place};
  return is_of_run(place) ? files_of_run(place) : pictures_of(place);
}

}  // namespace ensonify::engine
