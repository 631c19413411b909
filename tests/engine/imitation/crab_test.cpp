// Headings that the samples of a line contradict.

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/data.h"
#include "support/files.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/imitation/crab.h>
#include <ensonify/engine/imitation/line_model.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/reader.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

/// A recording of the program: northwards, with the bow 12 degrees to starboard of the
/// course, unless an override says otherwise.
RecordedLine crabbing_line(const std::filesystem::path& folder, const std::string& more_keys = "",
                           const std::vector<std::string>& overrides = {}) {
  const Scene scene = parse_scene(R"(
version = 1
texture = true
[seafloor]
extent_east_m = 80
extent_north_m = 60
cell_m = 0.25
depth_m = 14
[motion]
crab_deg = 12
[motion.heading]
rms_deg = 0.5
period_s = 7
[track]
pings = 260
speed_mps = 1.5
ping_interval_s = 0.08
altitude_m = 8
[sonar.sidescan]
frequency_hz = 400e3
range_m = 36
bins = 1200
bandwidth_hz = 30e3
array_length_m = 0.5
planes = 4
elevations = 1200
[output]
exr = false
xtf = true
)" + more_keys,
                                  "scene.toml", overrides);
  run(scene, folder, {});
  return read_recording(folder / "sidescan.xtf").at(0);
}

/// The mean of a path's headings, whose course is north.
double mean_heading_deg(const VehiclePath& path) {
  double sum = 0.0;
  for (const double heading : path.heading_rad)
    sum += std::remainder(heading, 2.0 * std::numbers::pi);
  return sum / static_cast<double>(path.heading_rad.size()) / degree;
}

}  // namespace

TEST_CASE("headings stay as stated where the bed moves as they say, and are turned where not") {
  const tests::TemporaryFolder folder;
  const RecordedLine line = crabbing_line(folder.path());
  const auto turned_by = [&](auto&& heading_of) {
    RecordedLine other = line;
    for (RecordedPing& ping : other.pings) ping.heading_rad = heading_of(*ping.heading_rad);
    return other;
  };
  {
    VehiclePath path = vehicle_path(LineWithBed(line));
    REQUIRE(mean_heading_deg(path) == Approx(12.0).margin(0.5));
    const std::vector<double> before = path.heading_rad;
    const HeadingCheck check = correct_heading(LineWithBed(line), path);
    CHECK(check.off_rad == 0.0);
    CHECK_FALSE(check.exchanged);
    CHECK_FALSE(check.long_forms);
    CHECK(path.heading_rad == before);
    CHECK(path.attitude.how == Confidence::stated);
  }
  {  // of a compass, with a pause in the recording
    RecordedLine paused = turned_by([](double h) { return h + 20.0 * degree; });
    for (std::size_t ping = 130; ping < paused.pings.size(); ++ping)
      *paused.pings[ping].t_s += 3600.0;
    VehiclePath path = vehicle_path(LineWithBed(paused));
    CHECK(correct_heading(LineWithBed(paused), path).off_rad / degree == Approx(20.0).margin(2.5));
  }
  {  // of a compass, where the magnetic north is 20 degrees west of north
    const RecordedLine magnetic = turned_by([](double h) { return h + 20.0 * degree; });
    VehiclePath path = vehicle_path(LineWithBed(magnetic));
    const HeadingCheck check = correct_heading(LineWithBed(magnetic), path);
    CHECK(check.off_rad / degree == Approx(20.0).margin(2.5));
    CHECK_FALSE(check.exchanged);
    CHECK(mean_heading_deg(path) == Approx(12.0).margin(2.5));
    CHECK(path.attitude.how == Confidence::measured);
  }
  {  // of a file that has exchanged the sides
    RecordedLine exchanged = line;
    std::swap(exchanged.port, exchanged.starboard);
    VehiclePath path = vehicle_path(LineWithBed(exchanged));
    const HeadingCheck check = correct_heading(LineWithBed(exchanged), path);
    CHECK(check.exchanged);
    CHECK(mean_heading_deg(path) == Approx(-12.0).margin(2.5));
  }
  {  // none stated
    RecordedLine none = line;
    for (RecordedPing& ping : none.pings) ping.heading_rad.reset();
    VehiclePath path = vehicle_path(LineWithBed(none));
    REQUIRE(path.heading_rad.empty());
    correct_heading(LineWithBed(none), path);
    REQUIRE(path.heading_rad.size() == none.pings.size());
    CHECK(mean_heading_deg(path) == Approx(12.0).margin(2.5));
  }
  {  // one side is not enough
    RecordedLine single = line;
    single.port.clear();
    VehiclePath path = vehicle_path(LineWithBed(single));
    CHECK(correct_heading(LineWithBed(single), path).off_rad == 0.0);
  }
}

TEST_CASE("ripples that run obliquely to the track do not turn headings") {
  const tests::TemporaryFolder folder;
  const RecordedLine line = crabbing_line(
      folder.path(),
      "[[seafloor.crests]]\nwavelength_m = 1.2\nheight_m = 0.2\nacross_crests_deg = 60\n",
      {"seafloor.extent_north_m=80", "track.speed_mps=2.2", "motion.crab_deg=6",
       "sonar.sidescan.bins=720", "sonar.sidescan.bandwidth_hz=15e3"});
  VehiclePath path = vehicle_path(LineWithBed(line));
  const std::vector<double> before = path.heading_rad;
  const HeadingCheck check = correct_heading(LineWithBed(line), path);
  CHECK(check.long_forms);
  CHECK(check.off_rad == 0.0);
  CHECK_FALSE(check.exchanged);
  CHECK(path.heading_rad == before);
}

TEST_CASE("the recipe of an imitation crabs as the recording does") {
  const tests::TemporaryFolder folder;
  const RecordedLine line = crabbing_line(folder.path());
  LineModel model;
  model.path = vehicle_path(LineWithBed(line));
  model.recorder = recorder_signs(LineWithBed(line));
  model.range_m = 36.0;
  model.samples = line.samples;
  model.bed = bed_extent(model);
  tests::write_text(folder / "recipe.toml", recipe_text(model));
  const Recipe recipe(folder / "recipe.toml", folder.path());
  for (const std::size_t i : {0u, 5u, 63u})
    CHECK(recipe.sample(i).scene.motion.crab_rad / degree == Approx(12.0).margin(1.5));
}

TEST_CASE("a real recording crabs as its headings say, with its sides exchanged") {
  const auto file = tests::data_file("sidescan/scotsman-iver2.xtf");
  if (!file) {
    WARN("skipped: the recording is not there");
    return;
  }
  const RecordedLine line = read_recording(*file).at(0);
  VehiclePath path = vehicle_path(LineWithBed(line));
  CHECK(correct_heading(LineWithBed(line), path).exchanged);
}
