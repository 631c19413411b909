// Imitations of whole lines, and what is refused.

#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <functional>
#include <numbers>
#include <numeric>
#include <random>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/small_recording.h"
#include "support/temporary_folder.h"

#include "made_line.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/imitation/imitate.h>
#include <ensonify/engine/imitation/pulse_signs.h>
#include <ensonify/engine/output/jsf.h>
#include <ensonify/engine/output/xtf.h>
#include <ensonify/engine/recording/recording_reader.h>
#include <ensonify/engine/recording/some_pings.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/scene/tables/track_reader.h>
#include <ensonify/engine/seafloor/material.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/decibel.h>

using namespace ensonify;
using namespace ensonify::engine;
using tests::made_line;
using tests::range_m;
using tests::sample_m;
using tests::samples;
using tests::varied_m;

TEST_CASE("a range that no sonar has is named") {
  RecordedLine line = made_line({});
  for (RecordedPing& ping : line.pings) ping.range_m = 1e9;
  const tests::TemporaryFolder folder;
  try {
    imitate(line, folder.path(), {});
    FAIL("no error");
  } catch (const RecordingError& error) {
    CHECK(std::string(error.what()).starts_with("the pings state a range of 1e+09 m"));
  }
}

TEST_CASE("numbers of a recording that no scene may have are named without the temporary folder") {
  RecordedLine line = made_line({});
  for (RecordedPing& ping : line.pings) ping.range_m = 0.05;
  const tests::TemporaryFolder folder;
  try {
    imitate(line, folder.path(), {});
    FAIL("no error");
  } catch (const SceneError& error) {
    const std::string message = error.what();
    CHECK_THAT(message, Catch::StartsWith("the scene:"));
    CHECK_THAT(message, Catch::Contains("'sonar.sidescan.range_m' is 0.05"));
    CHECK(message.find(folder.path().string()) == std::string::npos);
  }
}

TEST_CASE("a line whose samples are all the same is refused") {
  const tests::TemporaryFolder folder;
  for (const float value : {0.0f, 1000.0f}) {
    RecordedLine line = made_line({});
    std::ranges::fill(line.port, value);
    std::ranges::fill(line.starboard, value);
    for (RecordedPing& ping : line.pings) ping.altitude_m = 8.0;
    CHECK_THROWS_WITH(imitate(line, folder.path(), {}),
                      Catch::Contains(fmt::format("all samples of the recording are {},", value)));
  }
}

TEST_CASE("pings of the most frequent range are imitated, however long the others are") {
  const auto outcome = [](std::size_t pings, std::size_t others) {
    RecordedLine line = made_line({.pings = pings});
    set_samples(line, 2 * samples);
    for (std::size_t i = 0; i < others; ++i) {
      RecordedPing ping = line.pings.back();
      ping.number = pings + i;
      ping.range_m = (2.0 + 0.1 * static_cast<double>(i)) * range_m;
      ping.samples = 2 * samples;
      line.pings.push_back(ping);
      line.port.resize(line.pings.size() * line.samples, 100.0f);
      line.starboard.resize(line.pings.size() * line.samples, 100.0f);
    }
    const tests::TemporaryFolder folder;
    try {
      imitate(line, folder.path(), {.progress = [](auto, auto, auto) { return false; }});
    } catch (const Stopped&) {
      return std::string("begins");
    } catch (const RecordingError& error) {
      return std::string(error.what());
    }
    return std::string("ends");
  };
  CHECK(outcome(200, 60) == "begins");
  CHECK(outcome(1, 60) ==
        "the recording has 1 ping of one range and length, and an imitation needs 64");
  CHECK(outcome(63, 60) ==
        "the recording has 63 pings of one range and length, and an imitation needs 64");
}

namespace {

/// A model with all that its scene can have: tones, a fitted beam, texture, attitude.
LineModel full_model() {
  const LineWithBed line(made_line({.altitude_m = &varied_m}));
  LineModel model;
  model.path = vehicle_path(line);
  for (std::size_t i = 0; i < model.path.t_s.size(); ++i) {
    model.path.roll_rad.push_back(0.01 * std::sin(0.7 * static_cast<double>(i)));
    model.path.heading_rad.push_back(0.1 + 0.002 * std::sin(0.3 * static_cast<double>(i)));
  }
  model.recorder = recorder_signs(line);
  model.range_m = range_m;
  model.samples = samples;
  model.frequency_hz = 1234567.8;
  model.array_length_m = 1.0 / 3.0;
  model.pulse.bandwidth_hz = 20e3 / 1.1;
  model.bed = bed_extent(model);
  model.tones = {105, 166, std::vector<std::int8_t>(std::size_t{105} * 166, 0)};
  model.tones.steps[3] = -2;
  model.tones.steps[7000] = 1;
  model.texture_shape = 0.7654321;
  model.glint_share = 0.1234567;
  model.gain_db = -100.0;
  for (std::vector<double>& side : model.vertical_db)
    for (std::size_t i = 0; i < grazing_cells; ++i)
      side.push_back(0.0 - 0.5 * static_cast<double>(i));
  return model;
}

}  // namespace

TEST_CASE("the files of a model's scene read back to the scene in memory, which makes its image") {
  const tests::TemporaryFolder folder;
  LineModel model = full_model();
  model.path = some_pings(model.path, {0, 1, 2, 3, 4, 5});
  write_scene(model, folder.path());
  const Scene read = read_scene(folder / "scene.toml");
  Scene made = scene_of(model);
  CHECK(dump_scene(made) == dump_scene(read));
  CHECK(read.warnings.empty());
  const NavigationLog log = read_track(read.track, {});
  for (std::vector<double> NavigationLog::*column :
       {&NavigationLog::t_s, &NavigationLog::x_m, &NavigationLog::y_m, &NavigationLog::z_m,
        &NavigationLog::roll_rad, &NavigationLog::pitch_rad, &NavigationLog::heading_rad})
    CHECK(log.*column == made.track.log.get()->*column);
  const auto pixels_of = [](const Scene& scene) {
    Simulator simulator(scene);
    return ping_all(scene, simulator, 0).images.front().pixels;
  };
  const BinLayers of_read = pixels_of(read), of_made = pixels_of(made);
  BinLayers::for_each([&](std::string_view name, auto layer) {
    CAPTURE(name);
    CHECK(of_made.*layer == of_read.*layer);
  });
  // What is in memory is used: the image follows it.
  auto level = std::make_shared<NavigationLog>(log);
  level->roll_rad.clear();
  made.track.log = level;
  CHECK(pixels_of(made).intensity != of_read.intensity);
  made = scene_of(model);
  for (VerticalLevel& one : made.sonars.front().vertical.measured[0]) one.level_db -= 1.0;
  CHECK(pixels_of(made).intensity != of_read.intensity);
  made = scene_of(model);
  for (Patch& patch : made.seafloor.seabed.patches) {
    AreaPixels pixels = *patch.area.pixels;
    pixels.values.assign(pixels.values.size(), static_cast<std::uint8_t>(patch.area.image_value));
    patch.area.pixels = std::make_shared<const AreaPixels>(std::move(pixels));
  }
  CHECK(pixels_of(made).intensity != of_read.intensity);
}

TEST_CASE("a model's scene and recipe are read without a fault, and each key has its evidence") {
  const tests::TemporaryFolder folder;
  const LineModel model = full_model();
  write_scene(model, folder.path());
  const Scene scene = read_scene(folder / "scene.toml");
  CHECK(scene.sonars.front().bins == 500);
  CHECK(scene.sonars.front().range_m == range_m);
  // The pattern is of one way, and its peak is 0 dB.
  const std::string beam = tests::read_text(folder / "beam.csv");
  CHECK(beam.find("\n1,0.000,0.000\n") != std::string::npos);
  CHECK(beam.find("\n9,-1.000,-1.000\n") != std::string::npos);
  CHECK(scene.track.kind == TrackKind::file);
  REQUIRE(scene.seafloor.seabed.patches.size() == 2);
  // The brightest has the sediment's strength, and the bed less; the gain makes up for it.
  CHECK(scene.sonars.front().receiver.gain_db == -98.0);
  REQUIRE(scene.materials.size() == 3);
  CHECK(scene.materials[0].strength_offset_db == -2.0);
  CHECK(scene.materials[1].strength_offset_db == -6.0);
  CHECK(scene.materials[2].strength_offset_db == 0.0);
  for (const FoundKey& key : found_keys(model)) CHECK_FALSE(key.name().empty());
  CHECK(scene.seafloor.depth_m == Approx(20.0).margin(0.1));

  tests::write_text(folder / "recipe.toml", recipe_text(model));
  const Recipe recipe(folder / "recipe.toml", folder.path());  // as --data
  for (const std::size_t i : {0u, 1u, 63u}) {
    const Scene sample = recipe.sample(i).scene;
    CHECK(sample.track.altitude_m >= 4.0);
    CHECK(sample.track.altitude_m <= 12.5);
    CHECK(sample.seafloor.depth_m > sample.track.altitude_m);
  }
}

namespace {

/// A quiet sonar over a level bed.
Scene level_scene(const std::vector<std::string>& overrides) {
  return parse_scene(R"(
version = 1
[seafloor]
extent_east_m = 70
extent_north_m = 40
cell_m = 0.5
depth_m = 14
fractal.height_at_1m_m = 0
[track]
pings = 96
ping_interval_s = 0.1
altitude_m = 8
[sonar.sidescan]
range_m = 30
vertical_beamwidth_deg = 60
tilt_deg = 30
planes = 2
noise = false
output_noise_db = -60
[output]
exr = false
)",
                     "scene.toml", overrides);
}

/// A recording of the level scene with 300 samples per side.
RecordedLine level_line(const tests::TemporaryFolder& folder, int altitude_m = 8) {
  run(level_scene({"sonar.sidescan.bins=300", "sonar.sidescan.bandwidth_hz=20e3",
                   "sonar.sidescan.elevations=500", "output.xtf=true",
                   fmt::format("track.altitude_m={}", altitude_m)}),
      folder / "run", {});
  return read_recording(folder / "run/sidescan.xtf").at(0);
}

}  // namespace

TEST_CASE("a weaker side stays weaker, and a silent one is left out and named") {
  const tests::TemporaryFolder folder;
  RecordedLine line = level_line(folder);
  const auto mean = [](const std::vector<float>& side) {
    return std::accumulate(side.begin(), side.end(), 0.0) / static_cast<double>(side.size());
  };
  for (const char* name : {"weaker", "silent", "missing"})
    std::filesystem::create_directory(folder / name);
  for (float& sample : line.port) sample *= 0.25f;
  const Imitation weaker = imitate(line, folder / "weaker", {});
  CHECK(mean(weaker.imitated.port) / mean(weaker.imitated.starboard) ==
        Approx(mean(line.port) / mean(line.starboard)).epsilon(0.15));
  const auto names_port = [](const Imitation& made) {
    return std::ranges::any_of(
        made.unknown, [](const std::string& one) { return one.starts_with("the port side: "); });
  };
  CHECK_FALSE(names_port(weaker));
  std::ranges::fill(line.port, 0.0f);
  const Imitation silent = imitate(line, folder / "silent", {});
  CHECK(silent.imitated.port.empty());
  CHECK(names_port(silent));
  line.port.clear();  // as a reader leaves it out
  const Imitation missing = imitate(line, folder / "missing", {});
  CHECK(missing.imitated.port.empty());
  CHECK(names_port(missing));
}

TEST_CASE("a contrast that no texture reaches, and a key at its limit, are named") {
  const tests::TemporaryFolder folder;
  RecordedLine line = level_line(folder, 4);
  const auto named = [](const Imitation& made, std::string_view what) {
    return std::ranges::any_of(made.unknown,
                               [&](const std::string& one) { return one.find(what) != one.npos; });
  };
  constexpr std::string_view contrast = "what makes the recording's contrast of",
                             limit = "material.bed.texture_shape would fit";
  for (const char* name : {"even", "uneven"}) std::filesystem::create_directory(folder / name);
  const Imitation even = imitate(line, folder / "even", {});
  CHECK_FALSE(named(even, contrast));
  CHECK_FALSE(named(even, limit));
  // Nearly all of the bed is silent, and few samples are very bright.
  std::mt19937 random(4);
  std::gamma_distribution<double> power(0.03);
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (std::size_t i = 0; i < side->size(); ++i)
      if (i % line.samples > 45)
        (*side)[i] = static_cast<float>(
            1.0 + std::min(32000.0, double{(*side)[i]} * std::sqrt(power(random) / 0.03)));
  const Imitation uneven = imitate(line, folder / "uneven", {});
  CHECK(named(uneven, contrast));
  CHECK(named(uneven, limit));
}

TEST_CASE("an imitation has the recording's numbers, and begins where the recording does") {
  const tests::TemporaryFolder folder;
  RecordedLine line = level_line(folder);
  constexpr std::size_t unrecorded = 20;
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (std::size_t i = 0; i < side->size(); ++i)
      (*side)[i] = i % line.samples < unrecorded ? 0.0f : 1.234e-7f * (*side)[i];
  for (RecordedPing& ping : line.pings) ping.unrecorded = unrecorded;
  std::filesystem::create_directory(folder / "imitation");
  const Imitation made = imitate(line, folder / "imitation", {});
  const auto mean = [](const std::vector<float>& side) {
    return std::accumulate(side.begin(), side.end(), 0.0) / static_cast<double>(side.size());
  };
  CHECK(mean(made.imitated.port) == Approx(mean(line.port)).epsilon(0.1));
  for (std::size_t ping = 0; ping < made.imitated.pings.size(); ++ping) {
    CHECK(made.imitated.pings[ping].unrecorded == unrecorded);
    const auto begin = made.imitated.row(Side::port, ping).first(unrecorded);
    CHECK(std::ranges::count(begin, 0.0f) == std::ssize(begin));
  }
  CHECK(std::ranges::any_of(made.unknown, [](const std::string& one) {
    return one.starts_with("the first 2.00 m of range: the recording begins there");
  }));
  // Nothing to doubt about the bottom line, until the water column is cut off.
  const auto doubts = [](const Imitation& imitation) {
    return std::ranges::any_of(imitation.unknown, [](const std::string& one) {
      return one.starts_with("whether the bottom line is right");
    });
  };
  CHECK_FALSE(doubts(made));
  for (std::size_t ping = 0; ping < line.pings.size(); ++ping) {
    line.pings[ping].unrecorded = 0;
    for (std::vector<float>* side : {&line.port, &line.starboard}) {
      const auto row = side->begin() + static_cast<std::ptrdiff_t>(ping * line.samples);
      std::rotate(row, row + 81, row + static_cast<std::ptrdiff_t>(line.samples));
    }
  }
  std::filesystem::create_directory(folder / "cut");
  CHECK(doubts(imitate(line, folder / "cut", {})));
}

TEST_CASE("a bed that is seen only at more than 14 degrees gets its texture too") {
  const tests::TemporaryFolder folder;
  RecordedLine line = level_line(folder);  // at 8 m of 30 m of range: from 15 degrees on
  std::mt19937 random(4);
  std::gamma_distribution<double> power(1.0);
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (float& sample : *side)
      sample = std::min(32767.0f, sample * static_cast<float>(std::sqrt(power(random))));
  std::filesystem::create_directory(folder / "imitation");
  CHECK(imitate(line, folder / "imitation", {}).model.texture_shape > 0.0);
}

TEST_CASE("bright and dark pings come back as such, and objects as places, not as clouds") {
  const tests::TemporaryFolder folder;
  run(level_scene({"sonar.sidescan.bins=300", "sonar.sidescan.bandwidth_hz=20e3",
                   "sonar.sidescan.elevations=500", "output.xtf=true", "track.pings=256",
                   "seafloor.extent_north_m=60", "sonar.sidescan.ping_gain_db=0.85",
                   "conditions=ideal", "track.altitude_m=4"}),
      folder / "run", {});
  RecordedLine line = read_recording(folder / "run/sidescan.xtf").at(0);
  for (std::size_t ping = 100; ping < 108; ++ping)
    for (std::size_t k = 200; k < 216; ++k) line.port[ping * line.samples + k] = 32767.0f;
  // Single bright samples all over the line, as clicks make them.
  std::mt19937 random(4);
  std::uniform_int_distribution<std::size_t> place(0, line.port.size() - 1);
  for (std::vector<float>* side : {&line.port, &line.starboard})
    for (std::size_t i = 0; i < line.port.size() / 120; ++i) (*side)[place(random)] = 20000.0f;
  std::filesystem::create_directory(folder / "imitation");
  const Imitation made = imitate(line, folder / "imitation", {});
  CHECK(made.model.ping_gain_db == Approx(0.85).epsilon(0.15));
  CHECK(made.model.tones.steps.empty());
  const auto brightness = std::ranges::find_if(
      made.statistics, [](const ComparedStatistic& one) { return one.name == "ping_brightness"; });
  REQUIRE(brightness != made.statistics.end());
  CHECK(brightness->b == Approx(brightness->a).epsilon(0.15));
  CHECK(made.model.glint_share < 0.15);
  const auto named = [&](std::string_view what) {
    return std::ranges::any_of(made.unknown,
                               [&](const std::string& one) { return one.find(what) != one.npos; });
  };
  CHECK(named("m to port of ping 10"));
  CHECK(named("material.bed.glint_share would fit"));
}

TEST_CASE("a sweep whose bandwidth a file states gets its window, and the bed its level") {
  for (const PulseWindow window : {PulseWindow::none, PulseWindow::hann}) {
    const bool hann = window == PulseWindow::hann;
    CAPTURE(hann);
    const tests::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "imitation");
    run(level_scene({"sonar.sidescan.bins=600", "sonar.sidescan.pulse=lfm",
                     "sonar.sidescan.pulse_length_s=2e-3", "sonar.sidescan.bandwidth_hz=15e3",
                     "sonar.sidescan.elevations=1000", "output.jsf=true",
                     hann ? "sonar.sidescan.window=hann" : "sonar.sidescan.window=none"}),
        folder / "run", {});
    const RecordedLine line = read_recording(folder / "run/sidescan.jsf").at(0);
    const Imitation made = imitate(line, folder / "imitation", {});
    CHECK(made.model.pulse.kind == PulseKind::lfm);
    CHECK(made.model.pulse.window == window);
    // A JSF does not state the beam. The altitude is the run's all the same, within a bin.
    CHECK(std::abs(made.model.path.bed_depth_m + made.model.altitude_shift_m - 14.0) < 0.07);
    std::size_t levels = 0;
    for (const ComparedStatistic& one : made.statistics)
      // Steeper levels are of few samples.
      if (one.name.starts_with("level_at_") && one.name.ends_with("_deg_db") &&
          std::stoi(one.name.substr(9)) < 60 && std::isfinite(one.a)) {
        CAPTURE(one.name);
        CHECK(one.b == Approx(one.a).margin(2.0));
        ++levels;
      }
    CHECK(levels > 6);
  }
}

TEST_CASE("sixty damaged recordings are refused, or read with what is whole in them") {
  Recording written = tests::small_recording(64);
  const NavPing first = written.pings.front();
  written.pings.clear();
  written.samples.clear();
  written.gain_db.resize(80);
  for (std::size_t row = 0; row < 80; ++row) {
    NavPing& ping = written.pings.emplace_back(first);
    ping.row = row;
    ping.number = row;
    ping.unix_ms += static_cast<std::int64_t>(250 * row);
    for (std::size_t i = 0; i < 128; ++i)
      written.samples.push_back(static_cast<std::uint16_t>((i > 44 && i < 84 ? 3 : 3000) +
                                                           (7919 * (row * 128 + i)) % 1000));
  }
  std::mt19937 random(11);
  std::size_t refused = 0, accepted = 0;
  for (int i = 0; i < 60; ++i) {
    std::string bytes =
        tests::as_text(i % 2 == 0 ? encode_xtf({&written, 1}) : encode_jsf({&written, 1}));
    const auto place = [&](std::size_t end) { return random() % end; };
    switch (i / 2 % 6) {
      case 0: bytes.resize(place(bytes.size())); break;
      case 1:
        for (int k = 0; k < 40; ++k) bytes[place(bytes.size())] ^= static_cast<char>(random());
        break;
      case 2: bytes.erase(place(bytes.size()), 1 + place(5000)); break;
      case 3: bytes.insert(place(bytes.size()), std::string(1 + place(5000), '\xfa')); break;
      case 4:
        for (int k = 0; k < 30; ++k)
          bytes[place(std::min<std::size_t>(bytes.size(), 1600))] = '\xff';
        break;
      default: {  // all ranges, altitudes or samples
        const std::size_t from = place(bytes.size());
        std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(from),
                    std::min(bytes.size() - from, place(60000)), static_cast<char>(i));
      }
    }
    CAPTURE(i);
    const tests::TemporaryFolder folder;
    try {
      for (const RecordedLine& line :
           parse_recording(std::as_bytes(std::span(bytes)), "damaged.xtf"))
        imitate(line, folder.path(),
                {.threads = 1, .progress = [](auto, auto, auto) { return false; }});
    } catch (const RecordingError& error) {
      ++refused;
      CHECK(std::string(error.what()).size() > 20);
    } catch (const SceneError&) {
      ++refused;
    } catch (const Stopped&) {
      ++accepted;
    }
  }
  CHECK(refused > 5);
  CHECK(refused + accepted == 60);
}
