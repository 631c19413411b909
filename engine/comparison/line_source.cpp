#include <ensonify/engine/comparison/line_source.h>

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ensonify/engine/base/number_in.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/comparison/picture_source.h>
#include <ensonify/engine/mosaic/image_reader.h>
#include <ensonify/engine/mosaic/recorded_run.h>
#include <ensonify/engine/output/recording.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/recording/some_pings.h>
#include <ensonify/engine/run/output_folder.h>
#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

/// A line of a recording with several files, which are in the order of the recording.
RecordedLine line_of_recording(const std::vector<fs::path>& files, const std::string& sonar) {
  std::vector<RecordedLine> lines = read_recordings(files);
  const std::string name = files.front().string();
  std::size_t number = lines.size() == 1 && sonar.empty() ? 1 : 0;
  if (!sonar.empty()) number = number_in<std::size_t>(sonar).value_or(0);
  if (lines.size() == 1 && number != 1)
    throw RecordingError(fmt::format(
        "{}: has one line, not a line '{}': leave --sonar-a or --sonar-b out", name, sonar));
  if (number < 1 || number > lines.size())
    throw RecordingError(fmt::format(
        "{}: {}; give --sonar-a or --sonar-b a number from 1 up to {}, see recording-info", name,
        sonar.empty() ? fmt::format("has {} lines", lines.size())
                      : fmt::format("has no line '{}'", sonar),
        lines.size()));
  auto [line, left_out] = alike_pings(std::move(lines[number - 1]));
  if (!left_out.empty()) line.warnings.push_back(fmt::format("{}: {}", name, left_out));
  return std::move(line);
}

/// The recordings of a run, by the sonar's name or common_recording; files of parts are in the
/// order of the parts. The files are XTF files, or JSF files if there is no XTF file.
std::map<std::string, std::vector<fs::path>> recordings_of_run(const fs::path& folder) {
  std::map<std::string, std::vector<fs::path>> found;
  for (const std::string_view extension : {".xtf", ".jsf"}) {
    for (const fs::path& file : files_of_run(folder)) {
      const fs::path inside = file.lexically_relative(folder);
      if (file.extension() != extension || !stays_inside(inside)) continue;
      std::string name = file.stem().string();
      constexpr std::string_view part = "part";  // part_0001/NAME_0001.xtf
      const std::string of_part = inside.parent_path().string();
      if (of_part.starts_with(part) && name.ends_with(of_part.substr(part.size())))
        name.resize(name.size() - (of_part.size() - part.size()));
      found[name].push_back(file);
    }
    if (!found.empty()) break;
  }
  return found;
}

RecordedLine line_of_recordings(const fs::path& folder,
                                const std::map<std::string, std::vector<fs::path>>& recordings,
                                const std::string& sonar) {
  if (recordings.size() == 1 &&
      (sonar.empty() || recordings.begin()->first == std::string(common_recording)))
    return line_of_recording(recordings.begin()->second, sonar);
  if (const auto chosen = recordings.find(sonar); chosen != recordings.end())
    return line_of_recording(chosen->second, "");
  std::vector<std::string> names;
  for (const auto& [name, files] : recordings) names.push_back(name);
  throw RecordingError(fmt::format("{}: {}; choose one by its name with --sonar-a or --sonar-b: {}",
                                   folder.string(),
                                   sonar.empty() ? "has recordings of several sonars"
                                                 : fmt::format("there is no sonar '{}'", sonar),
                                   fmt::join(names, ", ")));
}

RecordedLine line_of_run(const fs::path& folder, const std::string& sonar) {
  const auto is_image = [](const fs::path& file) { return file.extension() == ".exr"; };
  if (std::ranges::none_of(files_of_run(folder), is_image))
    if (const auto recordings = recordings_of_run(folder); !recordings.empty())
      return line_of_recordings(folder, recordings, sonar);
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

/// Whether a folder is the folder of a run; if not, it has pictures.
bool is_of_run(const fs::path& folder) {
  return fs::exists(folder / "manifest.json") || pictures_of(folder).empty();
}

}  // namespace

RecordedLine read_line(const fs::path& place, const std::string& sonar) {
  if (!fs::is_directory(place)) return line_of_recording({place}, sonar);
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
