// The altitude of recordings whose altitude column or water column is wrong.

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "support/catch.h"
#include "support/data.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/quantile.h>
#include <ensonify/engine/imitation/vehicle_path.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/reader.h>

using namespace ensonify;
using namespace ensonify::tests;
using namespace ensonify::engine;

namespace {

/// A recording of the program, whose altitude column is right.
RecordedLine recorded_line(const std::filesystem::path& folder, int seed = 1) {
  Scene scene = parse_scene(R"(
version = 1
[seafloor]
extent_east_m = 80
extent_north_m = 60
cell_m = 0.5
depth_m = 14
fractal.height_at_1m_m = 0
[track]
pings = 200
speed_mps = 1.5
ping_interval_s = 0.1
altitude_m = 8
[motion.heave]
rms_m = 1
period_s = 12
[sonar.sidescan]
frequency_hz = 400e3
range_m = 36
bins = 600
bandwidth_hz = 20e3
vertical_beamwidth_deg = 60
tilt_deg = 30
planes = 4
elevations = 800
[output]
exr = false
xtf = true
)",
                            "scene.toml");
  scene.seed = static_cast<std::uint64_t>(seed);
  run(scene, folder, {});
  return read_recording(folder / "sidescan.xtf").at(0);
}

std::vector<double> altitudes_of(const RecordedLine& line) {
  std::vector<double> altitudes_m;
  for (const RecordedPing& ping : line.pings) altitudes_m.push_back(ping.altitude_m.value());
  return altitudes_m;
}

/// How far a path is off, in bins: nine of ten pings are nearer.
double bins_off(const RecordedLine& line, const std::vector<double>& altitudes_m) {
  const VehiclePath path = vehicle_path(LineWithBed(line));
  std::vector<double> off;
  for (std::size_t i = 0; i < altitudes_m.size(); ++i)
    off.push_back(std::abs(path.altitude_m[i] - altitudes_m[i]) / line.pings[i].range_m *
                  static_cast<double>(line.samples));
  return quantile(std::move(off), 0.9);
}

RecordedLine with_altitudes(
    RecordedLine line,
    const std::function<std::optional<double>(std::size_t ping, double altitude_m)>& changed) {
  for (std::size_t i = 0; i < line.pings.size(); ++i)
    line.pings[i].altitude_m = changed(i, line.pings[i].altitude_m.value_or(0.0));
  return line;
}

}  // namespace

TEST_CASE("a path has the altitude that the picture shows, whatever the file states") {
  constexpr double near = 4.0;
  for (const int seed : {1, 5, 21}) {
    const TemporaryFolder folder;
    const RecordedLine line = recorded_line(folder.path(), seed);
    const std::vector<double> truth_m = altitudes_of(line);
    CHECK(bins_off(line, truth_m) < near);
    const double bin_m = line.pings[0].range_m / static_cast<double>(line.samples);
    for (const double bins : {10.0, -10.0, 30.0, -30.0}) {
      CAPTURE(seed, bins);
      CHECK(bins_off(with_altitudes(line,
                                    [&](std::size_t ping, double m) -> std::optional<double> {
                                      if (ping % 30 < 8) return std::nullopt;
                                      return m + bins * bin_m;
                                    }),
                     truth_m) < near);
    }
    CHECK(bins_off(with_altitudes(line, [](std::size_t, double) { return std::nullopt; }),
                   truth_m) < near);

    // Fish on both sides, on which the altimeter has locked in a part of the line.
    RecordedLine fish = line;
    const float bright = std::ranges::max(line.port);
    for (std::vector<float>* side : {&fish.port, &fish.starboard})
      for (std::size_t ping = 60; ping < 150; ++ping)
        for (std::size_t k = 50; k < 62; ++k) (*side)[ping * line.samples + k] = bright;
    CHECK(bins_off(fish, truth_m) < near);
    CHECK(bins_off(with_altitudes(fish, [](std::size_t, double) { return std::nullopt; }),
                   truth_m) < near);
    CHECK(bins_off(with_altitudes(fish,
                                  [&](std::size_t ping, double m) {
                                    return ping >= 80 && ping < 140 ? 50 * bin_m : m + 30 * bin_m;
                                  }),
                   truth_m) < near);
  }
}

TEST_CASE("a line without a bottom line has the altitude that the file states, or is refused") {
  const TemporaryFolder folder;
  RecordedLine line = recorded_line(folder.path());
  const std::vector<double> truth_m = altitudes_of(line);
  CHECK(vehicle_path(LineWithBed(line)).altitude.how == Confidence::measured);
  std::ranges::fill(line.port, 100.0f);
  std::ranges::fill(line.starboard, 100.0f);
  CHECK(bins_off(line, truth_m) < 1.0);
  CHECK(vehicle_path(LineWithBed(line)).altitude.how == Confidence::stated);
  std::ranges::fill(line.port, 0.0f);
  std::ranges::fill(line.starboard, 0.0f);
  CHECK(bins_off(line, truth_m) < 1.0);
  CHECK(vehicle_path(LineWithBed(line)).altitude.how == Confidence::stated);
  CHECK_THROWS_AS(vehicle_path(LineWithBed(
                      with_altitudes(line, [](std::size_t, double) { return std::nullopt; }))),
                  RecordingError);
}

TEST_CASE("altitudes that are moved do not move the path of real recordings") {
  for (const char* name : {"sidescan/scotsman-iver2.xtf", "sidescan/river-1236.xtf"}) {
    const auto file = data_file(name);
    if (!file) {
      WARN("skipped: " << name << " is not there");
      continue;
    }
    CAPTURE(name);
    const RecordedLine line = read_recording(*file).at(0);
    const std::vector<double> before_m = vehicle_path(LineWithBed(line)).altitude_m;
    const bool stated = line.pings.back().altitude_m.has_value();
    if (stated) {
      std::vector<double> off_m;
      for (std::size_t i = 1; i < line.pings.size(); ++i)
        off_m.push_back(std::abs(before_m[i] - *line.pings[i].altitude_m));
      CHECK(median(off_m) < 0.7);  // the altimeter sits elsewhere
    }
    const double bin_m = line.pings.back().range_m / static_cast<double>(line.samples);
    for (const double bins : {0.0, 10.0, -10.0, 30.0, -30.0}) {
      CAPTURE(bins);
      // A ping without a stated altitude gets one that follows the bottom line.
      std::size_t ping = 0;
      RecordedLine moved = line;
      for (RecordedPing& one : moved.pings) {
        one.altitude_m = stated ? one.altitude_m : before_m[ping];
        if (one.altitude_m) *one.altitude_m += bins * bin_m;
        if (++ping % 40 < 10) one.altitude_m.reset();
      }
      CHECK(bins_off(moved, before_m) < 2.0);
    }
  }
}
