#include <ensonify/engine/mosaic/recorded_run.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/csv_table.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/image/line_layout.h>
#include <ensonify/engine/mosaic/image_reader.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

// In the order of `columns`.
enum Column { t, pose, reported = pose + 6, altitude = reported + 6, first_port, first_starboard };
constexpr std::array columns{
    CsvColumn{"t_s"},
    CsvColumn{"x_m"},
    CsvColumn{"y_m"},
    CsvColumn{"z_m"},
    CsvColumn{"roll_deg"},
    CsvColumn{"pitch_deg"},
    CsvColumn{"heading_deg"},
    CsvColumn{"reported_x_m"},
    CsvColumn{"reported_y_m"},
    CsvColumn{"reported_z_m"},
    CsvColumn{"reported_roll_deg"},
    CsvColumn{"reported_pitch_deg"},
    CsvColumn{"reported_heading_deg"},
    CsvColumn{.name = "altitude_m", .may_be_empty = true},
    CsvColumn{.name = "first_return_port", .may_be_empty = true},
    CsvColumn{.name = "first_return_starboard", .may_be_empty = true},
};

[[noreturn]] void fail_run(const fs::path& file, std::string_view what) {
  throw SceneError(fmt::format("{}: {}", file.string(), what));
}

struct ManifestContent {
  std::string scene, reference;
  std::vector<fs::path> images;
};

ManifestContent read_manifest(const fs::path& folder) {
  const fs::path file = folder / "manifest.json";
  std::error_code unknown;
  if (!fs::is_regular_file(file, unknown))
    fail_run(folder,
             fs::is_regular_file(folder, unknown)
                 ? "this is a file; give the folder of a finished `ensonify run` (of a "
                   "recording, `ensonify imitate` makes a scene that can be run)"
                 : "there is no manifest.json; give the folder of a finished `ensonify run`");
  const auto manifest =
      json_or_null<nlohmann::json>(refine::read_user_file<SceneError>(file, most_json_bytes));
  const char* const damaged = "this is not the manifest of a run; make the run again";
  if (!manifest.is_object() || !manifest.contains("scene") || !manifest["scene"].is_string() ||
      !manifest.contains("files") || !manifest["files"].is_array())
    fail_run(file, damaged);
  ManifestContent content{.scene = manifest["scene"], .reference = {}, .images = {}};
  if (manifest.contains("reference")) {
    if (!manifest["reference"].is_string()) fail_run(file, damaged);
    content.reference = manifest["reference"];
  }
  for (const nlohmann::json& record : manifest["files"]) {
    if (!record.is_object() || !record.contains("name") || !record["name"].is_string() ||
        !record.contains("size_bytes") || !record["size_bytes"].is_number_unsigned() ||
        !record.contains("xxh128") || !record["xxh128"].is_string())
      fail_run(file, damaged);
    const fs::path name = record["name"].get<std::string>();
    if (name.extension() != ".exr") continue;
    if (!stays_inside(name))
      fail_run(file, fmt::format("the file '{}' is not in the run's folder", name.string()));
    if (const auto bytes = fs::file_size(folder / name, unknown); unknown)
      fail_run(folder / name, "the file is missing; copy the whole folder, or make the run again");
    else if (bytes != record["size_bytes"].get<std::uintmax_t>())
      fail_run(
          folder / name,
          fmt::format("the file has {} bytes, its manifest gives {}; copy the file again, or make "
                      "the run again",
                      bytes, record["size_bytes"].get<std::uintmax_t>()));
    if (xxh128_of_file(folder / name) != record["xxh128"].get<std::string>())
      fail_run(folder / name,
               "its content has changed since it was written; copy the file again, or make the run "
               "again");
    content.images.push_back(folder / name);
  }
  if (content.images.empty())
    fail_run(folder, "the run has no OpenEXR images; run its scene again with output.exr = true");
  return content;
}

std::string choose(const fs::path& folder, const std::string& wanted,
                   const std::vector<std::string>& sonars) {
  if (wanted.empty() && sonars.size() > 1)
    fail_run(folder,
             fmt::format("the run has the sonars {}; choose one by its name with --sonar (in "
                         "compare --sonar-a or --sonar-b)",
                         fmt::join(sonars, ", ")));
  if (!wanted.empty() && std::ranges::find(sonars, wanted) == sonars.end())
    fail_run(folder, fmt::format("there is no sonar '{}', expected one of: {}", wanted,
                                 fmt::join(sonars, ", ")));
  return wanted.empty() ? sonars.front() : wanted;
}

/// Appends the pings of the images' tables to a run.
class PingReader {
 public:
  PingReader(RecordedRun& run, Positions positions) : run_(run), positions_(positions) {}

  void read(const fs::path& table_file, std::size_t rows) {
    const CsvTable table = CsvTable::read(table_file, {.row = "ping", .columns = columns});
    if (table.rows() != rows)
      fail_run(table_file,
               fmt::format("there are {} pings, but the image has {} rows; copy both files "
                           "again, or make the run again",
                           table.rows(), rows));
    for (std::size_t row = 0; row < rows; ++row) {
      const Pose vehicle = pose_at(table, row, Column::pose);
      const Pose sonar = mounted(vehicle, run_.sonar.mounting);
      const Pose shown = positions_ == Positions::truth
                             ? sonar
                             : mounted(pose_at(table, row, Column::reported), run_.sonar.mounting);
      const double altitude_m = table.at(row, Column::altitude);
      const double height_m = std::isnan(altitude_m)
                                  ? first_return_m(table, row)
                                  : altitude_m + sonar.position.z() - vehicle.position.z();
      run_.pings.push_back({.place_m = shown.position.head<2>(),
                            .heading_rad = shown.heading_rad,
                            .height_m = std::max(height_m, 0.0),
                            .image = static_cast<std::uint32_t>(run_.images.size() - 1),
                            .row = static_cast<std::uint32_t>(row)});
      times_s_.push_back(table.at(row, Column::t));
    }
  }

  /// Interpolates the rows that repeat a report, over the time until the next report. After the
  /// last report the sonar keeps its speed for the longest time between two reports, and then
  /// stops. A ping has a row for each beam, and the beams are interpolated separately.
  void interpolate_repeats() {
    const auto beams = static_cast<std::size_t>(run_.sonar.beams);
    for (std::size_t beam = 0; beam < beams; ++beam) interpolate_repeats(beam, beams);
  }

 private:
  static Pose pose_at(const CsvTable& table, std::size_t row, std::size_t column) {
    const auto value = [&](std::size_t i) { return table.at(row, column + i); };
    return {.position = {value(0), value(1), value(2)},
            .roll_rad = value(3) * degree,
            .pitch_rad = value(4) * degree,
            .heading_rad = value(5) * degree};
  }

  /// The slant range of the first echo; 0 if there is none.
  double first_return_m(const CsvTable& table, std::size_t row) const {
    const double bin =
        std::fmin(table.at(row, Column::first_port), table.at(row, Column::first_starboard));
    return std::isnan(bin) ? 0.0 : (bin + 0.5) * run_.sonar.bin_m();
  }

  /// Interpolates every `step`th row from row `begin` on.
  void interpolate_repeats(std::size_t begin, std::size_t step) {
    std::vector<MosaicPing>& pings = run_.pings;
    const auto repeats = [&](std::size_t i) {
      return pings[i].place_m == pings[i - step].place_m &&
             pings[i].heading_rad == pings[i - step].heading_rad;
    };
    double longest_s = 0.0;     // the longest time between two reports
    std::size_t first = begin;  // the first of the rows with the same report
    for (std::size_t next = begin + step; next < pings.size(); next += step) {
      if (repeats(next)) continue;
      longest_s = std::max(longest_s, times_s_[next] - times_s_[first]);
      for (std::size_t i = first + step; i < next; i += step)
        pings[i] = at_time(times_s_[i], i, first, next);
      first = next;
    }
    if (first == begin) return;
    for (std::size_t i = first + step; i < pings.size(); i += step)
      pings[i] =
          at_time(std::min(times_s_[i], times_s_[first] + longest_s), i, first - step, first);
  }

  /// Row i, placed on the straight line through the reports of the rows `from` and `to`, at a time.
  MosaicPing at_time(double t_s, std::size_t i, std::size_t from, std::size_t to) const {
    const MosaicPing &a = run_.pings[from], &b = run_.pings[to];
    const double time_s = times_s_[to] - times_s_[from];
    const double share = time_s > 0.0 ? (t_s - times_s_[from]) / time_s : 0.0;
    MosaicPing ping = run_.pings[i];
    ping.place_m = a.place_m + share * (b.place_m - a.place_m);
    ping.heading_rad = a.heading_rad + share * std::remainder(b.heading_rad - a.heading_rad,
                                                              2.0 * std::numbers::pi);
    return ping;
  }

  RecordedRun& run_;
  Positions positions_;
  std::vector<double> times_s_;
};

}  // namespace

RecordedRun read_recorded_run(const fs::path& folder, const std::string& sonar,
                              Positions positions) {
  const ManifestContent manifest = read_manifest(folder);
  const Scene scene =
      parse_recipe_unchecked(manifest.scene, (folder / "manifest.json").string(), {});
  std::vector<std::string> names, sonars;  // the sonar of each image; each sonar once
  for (const fs::path& image : manifest.images) {
    names.push_back(ImageReader(image).text("sonar"));
    if (std::ranges::find(sonars, names.back()) == sonars.end()) sonars.push_back(names.back());
  }
  const std::string name = choose(folder, sonar, sonars);

  RecordedRun run;
  const auto settings = std::ranges::find(scene.sonars, name, &Sonar::name);
  if (settings == scene.sonars.end())
    fail_run(folder / "manifest.json",
             fmt::format("its scene has no sonar '{}'; make the run again", name));
  run.sonar = *settings;
  if (run.sonar.steers())
    fail_run(folder / "manifest.json",
             fmt::format("its sonar '{}' looks ahead; a mosaic is made of a sidescan", name));
  PingReader pings(run, positions);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] != name) continue;
    const ImageReader image(manifest.images[i]);
    const Eigen::Vector3d origin{image.number("world_origin_x_m"), image.number("world_origin_y_m"),
                                 image.number("world_origin_z_m")};
    const double bins = image.number("bins"), range_m = image.number("range_m");
    if (run.images.empty()) {
      run.sonar.bins = static_cast<int>(std::clamp(bins, 0.0, 1e6));
      run.sonar.range_m = range_m;
      run.world_origin = origin;
    }
    if (run.sonar.bins < 1 || run.sonar.bins != bins || !(range_m > 0.0 && range_m < 1e6) ||
        run.sonar.range_m != range_m || run.world_origin != origin || !origin.allFinite() ||
        image.columns() != LineLayout(run.sonar).columns())
      fail_run(manifest.images[i],
               "bins, range or origin do not fit the scene or the run's other images; make the run "
               "again");
    run.images.push_back(manifest.images[i]);
    fs::path table = manifest.images[i];
    table.replace_filename(table.stem().string() + "_pings.csv");
    pings.read(table, image.rows());
  }
  if (positions == Positions::navigation) pings.interpolate_repeats();
  run.reference = manifest.reference;
  return run;
}

}  // namespace ensonify::engine
