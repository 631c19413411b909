// A scene file is read, and written again, with every value as it was.

#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/reader.h>

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <set>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/parsed_scene.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/keys/toml_value.h>
#include <ensonify/engine/session_keys.h>

using namespace ensonify::engine;
using ensonify::tests::contents;
using ensonify::tests::error_of;
using ensonify::tests::head;
using ensonify::tests::parsed;
using ensonify::tests::TemporaryFolder;
using ensonify::tests::write_text;
namespace fs = std::filesystem;

namespace {

const std::string busy_scene = R"(# every section
version = 1
seed = 9223372036854775807
speckle = false
[sea]
temperature_c = 4.1
sound_speed_mps = 1487.123456789012345
absorption_db_per_km = 1e-3
[seafloor]
extent_east_m = 123.4
cell_m = 0.1
material = "own-1"
[seafloor.fractal]
hurst = 0.33
spectrum = "paper"
[seafloor.ripples]
rms_height_m = 0.04
across_crests_deg = 33.3
[material.own-1]
model = "small-slope"
like = "cobble"
exponent = 3.1
[material.plate]
model = "solid"
like = "wood"
lobe_width_deg = 7.3
[track]
pings = 17
heading_deg = -0.1
[motion]
roll_deg = 2.7
[motion.heading]
rms_deg = 1.3
wander_s = 33.3
[navigation]
heading_step_deg = 0.1
[sonar.zeta]
frequency_hz = 123456.7
shading = "weights"
shading_weights = [0.1, 0.7, 1, 0.7, 0.1]
receive_shading = "taylor"
focus_zones_m = [7.3, 40]
vertical_beamwidth_deg = 51.7
tilt_deg = 19.3
[sonar.alpha-2]
preset = "deepvision-de340"
sides = "port"
mount_azimuth_deg = -90.1
bins = 77
sector_low_deg = 1.1
[display]
palette = "copper"
absorption = false
[run]
intersector = "brute_force"
[output]
npz = true
)";

}  // namespace

TEST_CASE("A version alone is the default scene") {
  CHECK(contents(parsed("version = 1")) == contents(Scene{}));
}

TEST_CASE("A dumped scene reads back to the same bits") {
  const Scene busy = parsed(busy_scene);
  CHECK(busy.seed == 9223372036854775807u);
  CHECK(busy.seafloor.fractal.spectrum == FractalSpectrum::paper);
  CHECK(busy.sonars.size() == 2);
  CHECK(busy.sonars[0].name == "zeta");  // the file's order
  CHECK(busy.sonars[1].bins == 77);
  for (const Scene& scene : {Scene{}, busy})
    for (const bool with_comments : {true, false}) {
      const std::string text = dump_scene(scene, with_comments);
      const Scene back = parsed(text);
      CHECK(contents(back) == contents(scene));
      CHECK(dump_scene(back, with_comments) == text);
    }
}

TEST_CASE("Whole degrees and tenths keep their text through radians") {
  for (int tenths = -1800; tenths <= 1800; ++tenths) {
    Scene scene;
    const std::string text = fmt::format("{}", tenths / 10.0);
    scene.track.heading_rad = tenths / 10.0 * degree;
    REQUIRE(dump_scene(scene, false).find("heading_deg = " + text + "\n") != std::string::npos);
  }
}

TEST_CASE("A word of a scene may be written with - or _, and is kept as it is documented") {
  CHECK(parsed(head + "[run]\nintersector = \"brute-force\"").run.intersector == "brute_force");
  CHECK(parsed(head, {"run.intersector=fan-scan"}).run.intersector == "fan_scan");
  CHECK(parsed(head + "[track]\nkind = \"lawn_mower\"").track.kind == TrackKind::lawn_mower);
}

TEST_CASE("An error of TOML has the parser's words and place") {
  CHECK(error_of(head + "seed = 1\nseed = 2").starts_with("s.toml:3:"));
  CHECK(error_of(head + "seed = 1\nseed = 2").find("seed") != std::string::npos);
  CHECK(error_of(head + "[sea\n").starts_with("s.toml:2:5: "));
  CHECK(error_of(head + "seed = 99999999999999999999").starts_with("s.toml:2:"));
  CHECK(error_of(head + "seed = \xff\xfe").starts_with("s.toml:2:7: "));
}

TEST_CASE("Integers stand for floats, and a byte-order mark and CRLF do not matter") {
  const Scene scene = parsed("\xef\xbb\xbfversion = 1\r\n[track]\r\nspeed_mps = 3\r\n");
  CHECK(scene.track.speed_mps == 3.0);
  CHECK(
      error_of("\xef\xbb\xbfversion = 1\r\n[track]\r\nspeed = 3\r\n").starts_with("s.toml:3:1: "));
}

TEST_CASE("A whole number for a real key is the nearest double, at any size") {
  for (const auto& [text, value] : {std::pair{"3", 3.0},
                                    {"9007199254740993", 0x1p53},
                                    {"9007199254740995", 0x1p53 + 4.0},
                                    {"-9007199254740993", -0x1p53},
                                    {"9223372036854775807", 0x1p63}}) {
    CAPTURE(text);
    const toml::table table =
        parse_toml(std::string("whole = ") + text + "\nreal = " + text + ".0");
    CHECK(number_of(*table.get("whole")) == value);
    CHECK(number_of(*table.get("real")) == value);
  }
  const toml::table others = parse_toml("a = true\nb = \"1\"\nc = [1]\nd = 1979-05-27");
  for (const auto& [key, node] : others) CHECK(!number_of(node));
}

TEST_CASE("A whole number above 2^53 is refused like any other out of range, through each door") {
  const std::string number = "9007199254740993";
  const std::string message =
      "'track.heading_deg' is " + number + ", expected a number from -360 to 360 degrees";
  CHECK(error_of(head + "[track]\nheading_deg = " + number) == "s.toml:3:15: " + message);
  const std::string override_text = "track.heading_deg=" + number;
  CHECK(error_of(head, {override_text}) == "-D " + override_text + ": " + message);
  CHECK(error_of([&] {  // that of the stream and of Python
          SessionScene(head, "s.toml", {}, {})
              .with(std::vector<KeyValue>{{"track.heading_deg", number}});
        }) == override_text + ": " + message);
  CHECK(
      error_of(head + "[sonar.a]\nfocus_zones_m = [5, " + number + "]").find("; number 2 is not") !=
      std::string::npos);
  CHECK(error_of(head + "[[objects]]\nshape = \"cable\"\npath = [[0, 0], [1, " + number + "]]")
            .find("; point 2 is not") != std::string::npos);
}

TEST_CASE("Keys, tables and values that are deep in each other are refused with the place") {
  std::string key = "a";
  for (int i = 1; i < 31000; ++i) key += ".a";
  const std::string message =
      "keys, tables and lists are more than 64 deep in each other here; remove some";
  for (const std::string& line : {key + " = 1", "[" + key + "]", "[[" + key + "]]",
                                  "b = {" + key + " = 1}", "b = " + std::string(31000, '[')}) {
    CAPTURE(line.substr(0, 20));
    const std::string error = error_of(head + line);
    CHECK(error.starts_with("s.toml:2:"));
    CHECK(error.ends_with(message));
  }
  const std::string of_override = error_of(head, {key + "=1"});
  CHECK(of_override.starts_with("-D a.a.a."));
  CHECK(of_override.ends_with("...: " + message));
}

TEST_CASE("Objects keep their order and their numbers, from the file, an override and a dump") {
  const TemporaryFolder folder;
  for (const char* name : {"wreck.ply", "rock.stl"}) write_text(folder / name, "");
  const std::string text =
      head +
      "[[objects]]\nmesh = \"wreck.ply\"\nclass = \"wreck\"\nheading_deg = 33.3\n"
      "[[objects]]\nmesh = \"rock.stl\"\nheight_m = -0.25\nscale = 1.5\n";
  const ScenePaths paths{folder.path(), {}};
  const Scene scene =
      parse_scene(text, "s.toml", std::vector<std::string>{"objects.1.east_m=7"}, paths);
  REQUIRE(scene.objects.size() == 2);
  CHECK(scene.objects[0].class_name == "wreck");
  CHECK(scene.objects[1].mesh.path == fs::canonical(folder / "rock.stl"));
  CHECK(scene.objects[1].height_m == -0.25);
  CHECK(scene.objects[1].east_m == 7.0);
  for (const bool with_comments : {true, false}) {
    const std::string dumped = dump_scene(scene, with_comments);
    const Scene back = parse_scene(dumped, "dumped", {}, paths);
    CHECK(contents(back) == contents(scene));
    CHECK(dump_scene(back, with_comments) == dumped);
  }
  for (const auto& [override_text, message] : std::vector<std::pair<std::string, std::string>>{
           {"objects.2.east_m=7", "the scene has no object \"2\"; it has 2, numbered from 0"},
           {"objects.x.east_m=7", "the scene has no object \"x\"; it has 2, numbered from 0"},
           {"objects.1.east=7", "unknown key \"east\" in [objects.1]; did you mean 'east_m'?"},
           {"objects.1.mesh=coral.ply", "'objects.1.mesh' names \"coral.ply\": No such file"}}) {
    const std::string error = error_of([&, &its_text = override_text] {
      parse_scene(text, "s.toml", std::vector<std::string>{its_text}, paths);
    });
    INFO(error);
    CHECK(error.starts_with("-D " + override_text + ": " + message));
  }
}

TEST_CASE("A scene file that cannot be one is refused by name") {
  TemporaryFolder folder;
  const auto error = [&](const fs::path& file) { return error_of([&] { read_scene(file); }); };
  CHECK(error(folder / "none.toml") ==
        (folder / "none.toml").string() + ": there is no such file; correct the path");
  CHECK(error(folder.path()) == folder.path().string() + ": is a folder; give the path of a file");
  CHECK(error("/dev/zero") == "/dev/zero: is not a regular file; correct the path");
  REQUIRE(mkfifo((folder / "fifo").c_str(), 0600) == 0);
  CHECK(error(folder / "fifo") ==
        (folder / "fifo").string() + ": is not a regular file; correct the path");
  write_text(folder / "huge.toml", head + std::string(1 << 20, '\n'));
  CHECK(error(folder / "huge.toml") ==
        (folder / "huge.toml").string() +
            ": has 1048588 bytes, expected at most 1048576; is it the right file?");
  write_text(folder / "fine.toml", head + std::string((1 << 20) - head.size(), '\n'));
  CHECK(error(folder / "fine.toml") == "no error");
}

TEST_CASE("Damaged scenes are read or refused with a place") {
  std::mt19937 random(7);
  const std::string whole = dump_scene(parsed(busy_scene));
  const auto below = [&](std::size_t end) {
    return std::uniform_int_distribution<std::size_t>(0, end - 1)(random);
  };
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    std::string text = i % 2 ? whole : busy_scene;
    switch (i % 5) {
      case 0: text.resize(below(text.size())); break;
      case 1: text[below(text.size())] ^= static_cast<char>(1u << below(8)); break;
      case 2: text.erase(below(text.size()), below(40)); break;
      case 3: text.insert(below(text.size()), text.substr(below(text.size()), below(80))); break;
      default:
        for (int n = 0; n < 20; ++n) text[below(text.size())] = static_cast<char>(below(256));
    }
    const std::string error = error_of(text);
    if (error == "no error") continue;
    ++refused;
    INFO(error);
    CHECK(error.starts_with("s.toml:"));
  }
  CHECK(refused > 100);
  CHECK(refused < 300);
  CHECK(error_of(head + "seed = " + std::string(100000, '[')).starts_with("s.toml:2:"));
  CHECK(error_of(head + std::string(100000, 'a') + " = 1").starts_with("s.toml:2:1: unknown key"));
  CHECK(error_of(std::string(1000, '\0')).starts_with("s.toml:1:1: "));
}

TEST_CASE("A preset sets the keys that are not given, in any order of reading") {
  const auto sonar = [&](const std::string& keys, const std::vector<std::string>& overrides = {}) {
    return parsed(head + "[sonar.a]\n" + keys, overrides).sonars.front();
  };
  const Sonar klein = sonar("preset = \"klein-5000\"");
  CHECK(klein.frequency_hz == 455e3);
  CHECK(klein.range_m == 150.0);
  CHECK(klein.name == "a");
  for (const std::string keys : {"preset = \"klein-5000\"\nbins = 12\ntilt_deg = 3",
                                 "bins = 12\ntilt_deg = 3\npreset = \"klein-5000\""}) {
    const Sonar own = sonar(keys);
    CHECK(own.bins == 12);
    CHECK(own.vertical.tilt_rad == 3.0 * degree);
    CHECK(own.source_level_db == klein.source_level_db);
  }
  // An override of the preset leaves what the file gives, and takes all else.
  const Sonar other =
      sonar("preset = \"klein-5000\"\nbins = 12", {"sonar.a.preset=klein-3000-low"});
  CHECK(other.bins == 12);
  CHECK(other.frequency_hz == 132e3);
  CHECK(sonar("preset = \"klein-5000\"", {"sonar.a.range_m=40"}).range_m == 40.0);
  CHECK(error_of(head + "[sonar.a]\npreset = \"klein-500\"").find("did you mean 'klein-5000'?") !=
        std::string::npos);
  CHECK(dump_scene(parsed(head + "[sonar.a]\npreset = \"klein-5000\""))
            .find("frequency_hz = 455000") != std::string::npos);
}

TEST_CASE("Conditions of a survey give what a scene leaves out, ideal ones have none of it") {
  const auto has_survey = [](const Scene& scene) {
    const bool sonars = std::ranges::all_of(scene.sonars, [](const Sonar& sonar) {
      return sonar.receiver.looks == 3 && sonar.receiver.detector == Detector::peak &&
             sonar.receiver.spreading == 30.0 && sonar.receiver.bed_level_db == -9.5 &&
             sonar.receiver.output_noise_db == -39.5 &&
             sonar.receiver.output_noise_wander_db == 3.5 && sonar.vertical.ripple_db == 1.0;
    });
    const bool rest = scene.arrivals.surface && scene.arrivals.burst_m > 0.0;
    CHECK(sonars == rest);
    CHECK((scene.display.spreading == 30.0) == rest);
    return sonars && rest;
  };
  const std::string two = "[sonar.a]\n[sonar.b]\n", preset = "preset = \"klein-5000\"\n";
  const Scene plain = parsed(head + two), by_preset = parsed(head + two + preset),
              survey = parsed(head + "conditions = \"survey\"\n" + two),
              ideal = parsed(head + "conditions = \"ideal\"\n" + two + preset);
  CHECK_FALSE(has_survey(plain));
  CHECK(plain.motion.roll.is_zero());
  CHECK(plain.texture);
  for (const Scene& scene : {by_preset, survey}) {
    CHECK(has_survey(scene));
    CHECK_FALSE(scene.motion.roll.is_zero());
    CHECK_FALSE(scene.motion.heave.is_zero());
    CHECK(scene.texture);
  }
  CHECK(ideal.sonars[1].frequency_hz == 455e3);
  CHECK_FALSE(has_survey(ideal));
  CHECK(ideal.motion.roll.is_zero());
  CHECK_FALSE(ideal.texture);
  CHECK_FALSE(parsed(head + two + preset, {"conditions=ideal"}).arrivals.surface);

  // What the scene gives stays, whatever the order.
  const Scene own =
      parsed(head + "[motion]\nroll = { rms_deg = 0.1 }\n[arrivals]\nsurface = false\n" + two +
                 preset + "looks = 2\n",
             {"texture=false"});
  CHECK(own.motion.roll.rms == 0.1 * degree);
  CHECK_FALSE(own.motion.heave.is_zero());
  CHECK_FALSE(own.arrivals.surface);
  CHECK_FALSE(own.texture);
  CHECK(own.sonars[1].receiver.looks == 2);
  CHECK(own.sonars[0].receiver.looks == 3);

  // A measured beam has its own ripple.
  const TemporaryFolder folder;
  write_text(folder / "beam.csv", "depression_deg,level_db\n0,0\n90,-20\n");
  write_text(folder / "s.toml", head + two + preset + "vertical_pattern = \"beam.csv\"\n");
  const Scene measured = read_scene(folder / "s.toml");
  CHECK(measured.sonars[0].vertical.ripple_db == 1.0);
  CHECK(measured.sonars[1].vertical.ripple_db == 0.0);

  // A recorded track has its own motion. A dump reads back as the same scene.
  const std::string of_file = "[track]\nkind = \"file\"\nfile = \"a.csv\"\n";
  const std::string text = head + "conditions = \"survey\"\n" + of_file + two;
  CHECK(parse_recipe_unchecked(text, "s.toml", {}).motion.roll.is_zero());
  CHECK(dump_scene(parsed(dump_scene(by_preset))) == dump_scene(by_preset));
}

TEST_CASE("A start time means the same with and without quotes") {
  const auto start_of = [](const std::string& time) {
    return parsed("version = 1\n[output]\nstart_time = " + time + "\n").output.start_time;
  };
  CHECK(start_of("\"2025-06-01T12:00:00Z\"") == "2025-06-01T12:00:00Z");
  CHECK(start_of("2025-06-01T12:00:00Z") == "2025-06-01T12:00:00Z");
}

TEST_CASE("Every key has help and a range, and reads what is written through -D") {
  std::set<std::string> names;
  const auto check = [&](const auto& key, auto& owner, const std::string& name) {
    INFO(name);
    CHECK(names.insert(name).second);
    CHECK(!key.help.empty());
    CHECK(key.help.ends_with("."));
    const Option option = key.option(owner);
    std::vector<std::string> bad = {"[1]", "{}", "2024-01-01"};
    if ((std::holds_alternative<std::string*>(option) && key.choices.empty()) ||
        std::holds_alternative<InputFile*>(option)) {
      bad.emplace_back("1");
    } else if (!key.choices.empty() || std::holds_alternative<bool*>(option)) {
      bad.insert(bad.end(), {"1", "word"});
    } else if (std::holds_alternative<std::vector<std::string>*>(option)) {
      bad = {"1", "{}", "[1]", "2024-01-01"};
    } else if (std::holds_alternative<std::vector<double>*>(option)) {
      bad = {"1", "{}", "[1e9]", "[1, true]", "2024-01-01"};
    } else {
      CHECK(key.range.low < key.range.high);
      bad.insert(bad.end(), {fmt::format("{:.17g}", key.range.low - 1.0),
                             fmt::format("{:.17g}", 1.01 * key.range.high + 1.0), "nan", "inf",
                             "true", "word"});
    }
    for (const std::string& value : bad) {
      const std::string error = error_of(head, {name + "=" + value});
      INFO(error);
      CHECK(error.starts_with("-D " + name + "=" + value + ": '" + name + "' is "));
      CHECK(error.find(", expected " + expectation(key)) != std::string::npos);
    }
  };
  Scene scene;
  for (const auto& section : scene_sections())
    for (const auto& key : section.keys)
      check(key, scene,
            section.name.empty() ? std::string(key.name)
                                 : fmt::format("{}.{}", section.name, key.name));
  for (const auto& key : sonar_section().keys)
    check(key, scene.sonars[0], fmt::format("sonar.sidescan.{}", key.name));

  // Each key's own value through -D, over a scene where everything else has been changed.
  std::vector<std::string> overrides;
  Scene busy = parsed(busy_scene);
  busy.seafloor.survey = {};
  for (const auto& section : scene_sections())
    for (const auto& key : section.keys)
      if (const auto text = option_text(key, busy))
        overrides.push_back(fmt::format("{}{}{}={}", section.name, section.name.empty() ? "" : ".",
                                        key.name, *text));
  for (const auto& key : sonar_section().keys)
    if (const auto text = option_text(key, busy.sonars[0]))
      overrides.push_back(fmt::format("sonar.zeta.{}={}", key.name, *text));
  for (Material& material : busy.materials)
    for (const auto& key : material_section().keys)
      if (const auto text = option_text(key, material))
        overrides.push_back(fmt::format("material.{}.{}={}", material.name, key.name, *text));
  busy.sonars.pop_back();
  CHECK(contents(parsed(head + "[sonar.zeta]\n[material.own-1]\n[material.plate]", overrides)) ==
        contents(busy));
}
