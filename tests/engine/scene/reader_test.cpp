#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/reader.h>

#include <sys/stat.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <random>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/output_formats.h>
#include <ensonify/engine/units.h>

using namespace ensonify::engine;
using ensonify::tests::TemporaryFolder;
using ensonify::tests::write_text;
namespace fs = std::filesystem;

namespace {

/// What an option holds, bit by bit.
template <class Owner>
std::string bits(const Key<Owner>& key, Owner& owner) {
  return std::visit(
      [](const auto* value) -> std::string {
        using T = std::remove_cvref_t<decltype(*value)>;
        if constexpr (std::is_same_v<T, std::optional<double>>)
          return *value ? fmt::format("{:x}", std::bit_cast<std::uint64_t>(**value)) : "unset";
        else if constexpr (std::is_same_v<T, std::optional<std::uint64_t>>)
          return *value ? fmt::format("{}", **value) : "unset";
        else if constexpr (std::is_same_v<T, std::vector<std::string>>)
          return fmt::format("{}", fmt::join(*value, "|"));
        else if constexpr (std::is_same_v<T, double>)
          return fmt::format("{:x}", std::bit_cast<std::uint64_t>(*value));
        else if constexpr (std::is_same_v<T, std::vector<double>>) {
          std::string all;
          for (const double v : *value)
            all += fmt::format("{:x} ", std::bit_cast<std::uint64_t>(v));
          return all;
        } else if constexpr (std::is_enum_v<T>)
          return fmt::format("{}", static_cast<int>(*value));
        else if constexpr (std::is_same_v<T, InputFile>)
          return value->name;
        else if constexpr (std::is_same_v<T, std::vector<Eigen::Vector2d>>) {
          std::string all;
          for (const Eigen::Vector2d& p : *value)
            for (const double v : p) all += fmt::format("{:x} ", std::bit_cast<std::uint64_t>(v));
          return all;
        } else {
          return fmt::format("{}", *value);
        }
      },
      key.option(owner));
}

/// Every option of a scene under its whole name, bit by bit.
std::vector<std::string> contents(Scene scene) {
  std::vector<std::string> out;
  for (const auto& section : scene_sections())
    for (const auto& key : section.keys)
      out.push_back(fmt::format("{}.{} {}", section.name, key.name, bits(key, scene)));
  for_each_list(scene, [&](const auto& section, auto& list) {
    for (auto& item : list)
      for (const auto& key : section.keys)
        out.push_back(fmt::format("{} {} {}", section.name, key.name, bits(key, item)));
  });
  for (Material& material : scene.materials)
    for (const auto& key : material_section().keys)
      out.push_back(fmt::format("{}.{} {}", material.name, key.name, bits(key, material)));
  for (Sonar& sonar : scene.sonars)
    for (const auto& key : sonar_section().keys)
      out.push_back(fmt::format("{}.{} {}", sonar.name, key.name, bits(key, sonar)));
  return out;
}

std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const SceneError& error) {
    return error.what();
  }
  return "no error";
}
std::string error_of(const std::string& text, const std::vector<std::string>& overrides = {},
                     const ScenePaths& paths = {}) {
  return error_of([&] { parse_scene(text, "s.toml", overrides, paths); });
}
Scene parsed(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return parse_scene(text, "s.toml", overrides);
}

const std::string head = "version = 1\n";

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
      bad.push_back("1");
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

TEST_CASE("A word of a scene may be written with - or _, and is kept as it is documented") {
  CHECK(parsed(head + "[run]\nintersector = \"brute-force\"").run.intersector == "brute_force");
  CHECK(parsed(head, {"run.intersector=fan-scan"}).run.intersector == "fan_scan");
  CHECK(parsed(head + "[track]\nkind = \"lawn_mower\"").track.kind == TrackKind::lawn_mower);
}

TEST_CASE("Each output format has a key, and no two the same") {
  std::set<std::string_view> names;
  for (const OutputFormat& format : output_formats()) {
    INFO(format.name);
    CHECK(names.insert(format.name).second);
    Scene scene = parsed(head, {fmt::format("output.{}=true", format.name)});
    CHECK(scene.output.*format.wanted);
    scene.output.*format.wanted = false;
    CHECK_FALSE(parsed(dump_scene(scene)).output.*format.wanted);
  }
}

TEST_CASE("One recording for more sonars than its format holds is refused") {
  std::string text = head + "[output]\none_recording = true\n";
  for (int i = 0; i < 4; ++i) text += "[sonar.s" + std::to_string(i) + "]\n";
  CHECK(parsed(text, {"output.jsf=true"}).sonars.size() == 4);
  CHECK(
      error_of(text, {"output.xtf=true"}).find("puts 4 sonars into one file, and an XTF holds 3") !=
      std::string::npos);
}

TEST_CASE("Each kind of error names its place, what was expected and a suggestion") {
  struct Case {
    std::string text, message;
  };
  const auto [text, message] = GENERATE(values<Case>({
      {"", "s.toml:1:1: no 'version', expected version = 1 at the top"},
      {"version = 2", "s.toml:1:11: 'version' is 2, expected 1, the only version"},
      {"version = \"1\"",
       "s.toml:1:11: 'version' is the string \"1\", expected 1, the only version"},
      {head + "sede = 3", "s.toml:2:1: unknown key \"sede\"; did you mean 'seed'?"},
      {head + "[sonar.a]\nrng = 3",
       "s.toml:3:1: unknown key \"rng\" in [sonar.a]; did you mean 'range_m'?"},
      {head + "[sae]", "s.toml:2:2: unknown key \"sae\"; did you mean 'sea'?"},
      {head + "[seafloor.ripple]\nhurst = 0.5",
       "s.toml:2:11: unknown key \"ripple\" in [seafloor]; did you mean 'ripples'?"},
      {head + "[sonar.a]\nfrequency_khz = 5",
       "s.toml:3:1: unknown key \"frequency_khz\" in [sonar.a]; did you mean 'frequency_hz'?"},
      {head + "[sonar.a]\nfrequency = 5",
       "s.toml:3:1: unknown key \"frequency\" in [sonar.a]; did you mean 'frequency_hz'?"},
      {head + "[track]\naltitude = 5",
       "s.toml:3:1: unknown key \"altitude\" in [track]; did you mean 'altitude_m'?"},
      {head + "range_m = 5",
       "s.toml:2:1: unknown key \"range_m\"; did you mean 'sonar.NAME.range_m'?"},
      {head + "[display]\nzzzzzzzzzz = 5",
       "s.toml:3:1: unknown key \"zzzzzzzzzz\" in [display]; expected one of of, spreading, "
       "absorption, slant_range_correction, speed_correction, beam_normalisation, flat_field, gain_db, "
       "mapping, gamma, range_db, smoothing_px, track_smoothing_px, palette"},
      {head + "\"sea.temperature_c\" = 5",
       "s.toml:2:1: unknown key \"sea.temperature_c\"; did you mean 'sea.temperature_c'?"},
      {head + "[output]\nclass_names = [\"none\"]",
       "s.toml:3:15: 'output.class_names' names \"none\", which is the name of number 0: leave it out"},
      {head + "[[objects]]\nshape = \"box\"\nclass = \"none\"",
       "s.toml:4:9: 'objects.0.class' is \"none\", which is the name of number 0: expected another name"},
      {head + "[material.none]\nlike = \"steel\"\nmodel = \"solid\"",
       "s.toml:2:11: a material is named \"none\", which is the name of number 0: expected another name"},
      {head + "[sonar.a]\nrange_m = 50\nsample_rate_hz = 10",
       "s.toml:4:18: 'sonar.a.sample_rate_hz' is 10 and makes bins of 74.5 m, longer than range_m, "
       "which is 50; expected at least 14.9 Hz"},
      {head + "sea = 3", "s.toml:2:7: 'sea' is 3, expected a table, [sea]"},
      {head + "sonar = 3", "s.toml:2:9: 'sonar.NAME' is 3, expected a table, [sonar.NAME]"},
      {head + "sonar = {}", "s.toml:2:9: 'sonar' is empty, expected [sonar.NAME]"},
      {head + "[[sonar]]\nbins = 3",
       "s.toml:2:1: 'sonar.NAME' is an array, expected a table, [sonar.NAME]"},
      {head + "[sonar]\nbins = 3",
       "s.toml:3:1: 'sonar.bins' does not say which sonar, expected sonar.NAME.bins, in a table "
       "[sonar.NAME]"},
      {head + "[sonar]\nbin = 3", "s.toml:3:7: 'sonar.bin' is 3, expected a table, [sonar.bin]"},
      {head + "[material]\nlike = \"rock\"",
       "s.toml:3:1: 'material.like' does not say which material, expected material.NAME.like, in a "
       "table [material.NAME]"},
      {head + "[track]\norigin = 3",
       "s.toml:3:1: unknown key \"origin\" in [track]; did you mean 'origin_lat_deg' or "
       "'origin_lon_deg'?"},
      {head + "[seafloor]\nmaterial = \"clayey\"",
       "s.toml:3:12: 'seafloor.material': material 'clayey' is not known; the nearest names are "
       "'clayey sand' (a sediment) and 'clayey silt' (a sediment); covers are seagrass, shells; solids are steel, "
       "fouled steel, aluminium, "
       "concrete, stone, wood, glass fibre, rubber, fouled rubber; or describe one in a table [material.NAME]"},
      {head + "[seafloor]\nmaterial = \"x\"\n[material.x]\nlike = \"steel\"",
       "s.toml:3:12: 'seafloor.material': like = \"steel\" is a solid; model = \"tr9407\" is for "
       "sediments, a solid needs model = \"solid\", a cover model = \"lambert\" and "
       "lambert_mu_db"},
      {head + "[sonar.\"a/b\"]",
       "s.toml:2:8: the sonar's name is \"a/b\", expected 1 to 64 letters, digits, _ and -"},
      {head + "[sonar.a]\n[sonar.a_ground]\n",
       "s.toml:3:8: a sonar named \"a_ground\" would have files of the same name as the sonar a; give "
       "it another name"},
      {head + "[sonar.a]\n[sonar.a_background]\n",
       "s.toml:3:8: a sonar named \"a_background\" would have files of the same name as the sonar a; "
       "give it another name"},
      {head + "[sonar.sample]\n",
       "s.toml:2:8: a sonar named \"sample\" would have files of the same name as sample.json; give "
       "it another name"},
      {head + "seed = -1",
       "s.toml:2:8: 'seed' is -1, expected a whole number from 0 to 9223372036854775807"},
      {head + "speckle = 1", "s.toml:2:11: 'speckle' is 1, expected true or false"},
      {head + "[artefacts]\nlost = { uniform = [0, 1] }\n[dataset]\nsamples = 2",
       "s.toml:4:2: this is a dataset's recipe, expected a scene: `ensonify generate` takes it"},
      {head + "[arrivals]\nburst_m = { times = \"draw.a\" }\n[draw]\na = 2",
       "s.toml:4:2: this is a dataset's recipe, expected a scene: `ensonify generate` takes it"},
      {head + "[track]\n  pings = 7.0",
       "s.toml:3:11: 'track.pings' is 7.0, expected a whole number from 1 to 10000000"},
      {head + "[track]\nspeed_mps = true",
       "s.toml:3:13: 'track.speed_mps' is true, expected a number from 0 to 50 m/s"},
      {head + "[track]\nspeed_mps = \"2\"",
       "s.toml:3:13: 'track.speed_mps' is the string \"2\", expected a number from 0 to 50 m/s"},
      {head + "[track]\nspeed_mps = [2]",
       "s.toml:3:13: 'track.speed_mps' is an array, expected a number from 0 to 50 m/s"},
      {head + "[track]\nspeed_mps = 2024-01-01",
       "s.toml:3:13: 'track.speed_mps' is a date or a time, expected a number from 0 to 50 m/s"},
      {head + "[track]\nspeed_mps = nan",
       "s.toml:3:13: 'track.speed_mps' is nan, expected a number from 0 to 50 m/s"},
      {head + "[track]\nspeed_mps = -inf",
       "s.toml:3:13: 'track.speed_mps' is -inf, expected a number from 0 to 50 m/s"},
      {head + "[track]\nheading_deg = 361",
       "s.toml:3:15: 'track.heading_deg' is 361, expected a number from -360 to 360 degrees"},
      {head + "[display]\npalette = \"gray\"",
       "s.toml:3:11: 'display.palette' is the string \"gray\", expected one of grey, copper, "
       "bronze, paper, viridis; did you "
       "mean 'grey'?"},
      {head + "[run]\nsurface = \"refine\"",
       "s.toml:3:11: 'run.surface' is the string \"refine\", expected one of auto, static, "
       "refined, "
       "footprint; did you mean 'refined'?"},
      // What keys say of each other.
      {head + "[seafloor]\nkind = \"survey\"",
       "s.toml:3:8: 'seafloor.kind' is \"survey\", but no survey is named: give its file as "
       "seafloor.survey"},
      {head + "[seafloor]\nsurvey = \"a.tif\"",
       "s.toml:3:10: 'seafloor.survey' needs seafloor.kind = \"survey\""},
      {head + "[seafloor]\nkind = \"survey\"\nripples.rms_height_m = 0.1",
       "s.toml:4:24: 'seafloor.ripples' needs seafloor.kind = \"fractal\"; on a survey, ripples are "
       "a layer [[seafloor.crests]]"},
      {head + "[seafloor]\nkind = \"mesh\"",
       "s.toml:3:8: 'seafloor.kind' is \"mesh\", but no mesh is named: give its file as "
       "seafloor.mesh"},
      {head + "[[objects]]\nmesh = \"a.ply\"\n[[objects]]\neast_m = 1",
       "s.toml:4:1: 'objects.1' has no mesh: give its file as mesh = \"...\", or a shape = \"...\" "
       "by "
       "name"},
      {head + "[objects]\nmesh = \"a.ply\"",
       "s.toml:2:1: 'objects' is a table, expected tables, [[objects]]"},
      {head + "objects = [1]", "s.toml:2:12: '[objects]' is 1, expected a table, [[objects]]"},
      {head + "[[objects]]\nmesh = \"a.ply\"\nhight_m = 1",
       "s.toml:4:1: unknown key \"hight_m\" in [objects.0]; did you mean 'height_m'?"},
      {head + "[[objects]]\nmesh = \"a.ply\"\nscale = 0",
       "s.toml:4:9: 'objects.0.scale' is 0, expected a number from 1e-06 to 1000000"},
      {head + "[seafloor]\nmaterial = \"medium sant\"",
       "s.toml:3:12: 'seafloor.material': material 'medium sant' is not known; the nearest names "
       "are 'medium sand' (a sediment), 'medium silt' (a sediment) and 'muddy sand' (a sediment); "
       "covers are seagrass, shells; solids are "
       "steel, fouled steel, aluminium, concrete, "
       "stone, "
       "wood, glass fibre, rubber, fouled rubber; or describe one in a table [material.NAME]"},
      {head + "[material.a]\nlike = \"seagrass\"\nmodel = \"solid\"",
       "s.toml:3:8: 'material.a.like': like = \"seagrass\" is a cover; model = \"solid\" is for "
       "solids: steel, fouled steel, aluminium, "
       "concrete, stone, wood, glass fibre, rubber, fouled rubber"},
      {head + "[material.a]\nspecular = 1\nlike = \"steel\"\nmodel = \"solid\"",
       "s.toml:4:8: 'material.a.like': solid: diffuse_db = -30 and specular = 1 scatter more "
       "energy than arrives: pi 10^(diffuse_db/10) + specular is 1.003, expected at most 1"},
      {head + "[sonar.a]\nsector_low_deg = 95",
       "s.toml: 'sonar.a.sector_high_deg' is 90, expected more than sector_low_deg, which is 95"},
      {head + "[sonar.a]\nvertical_beamwidth_deg = 0.1",
       "s.toml:3:26: 'sonar.a.vertical_beamwidth_deg' is 0.1, expected 0 (the same in all "
       "directions) or at least 0.5: a narrower beam is finer than the simulator's table of "
       "directions"},
      {head + "[sonar.a]\nplanes = 7",
       "s.toml:3:10: 'sonar.a.planes' is 7, expected an even number"},
      {head + "[sonar.a]\nsector_low_deg = -60\nsector_high_deg = 120",
       "s.toml:4:19: 'sonar.a.sector_high_deg' is 120, expected less than 180 degrees above "
       "sector_low_deg, which is -60"},
      {head + "[sea]\nsound_speed_mps=1500\n[sonar.a]\narray_length_m = 0.003",
       "s.toml:5:18: 'sonar.a.array_length_m' is 0.003, expected a wavelength or more, 0.00375 m "
       "at "
       "400000 Hz"},
      {head + "[sonar.a]\nshading = \"taylor\"\nshading_side_lobe_db = -40",
       "s.toml: 'sonar.a.taylor_nbar': Taylor's side lobes of -40 dB need an nbar of 6 or more, and "
       "it is 4"},
      {head + "[sonar.a]\nreceive_shading = \"weights\"\nreceive_shading_weights = [1, 2]",
       "s.toml:4:27: 'sonar.a.receive_shading_weights': weight 1 is 1 from one end and 2 from the "
       "other, expected the same"},
      {head + "[sonar.a]\nshading_weights = [1, 1]",
       "s.toml:3:19: 'sonar.a.shading_weights' needs shading = \"weights\""},
      {head + "[sonar.a]\nfocused = true\nfocus_zones_m = [10]",
       "s.toml:4:17: 'sonar.a.focus_zones_m' is given, and sonar.a.focused is true: the arrays are "
       "focused either in zones or at all ranges, leave one out"},
      {head + "[sonar.a]\nbandwidth_hz = 500e3",
       "s.toml:3:16: 'sonar.a.bandwidth_hz' is 500000, expected at most frequency_hz, which is "
       "400000"},
      {head +
           "[artefacts]\ninterference_db = 40\ninterference_range_m = 100\n[sonar.a]\nrange_m = 75",
       "s.toml:4:24: 'artefacts.interference_range_m' is 100, expected less than the range of a "
       "sonar, of which the longest is 75 m"},
      {head + "[seafloor]\ncell_m = 0.001",
       "s.toml:3:10: a seabed of 200 x 140 m in cells of 0.001 m has 2.8e+10 points, expected at "
       "most 1.07e+09: make the cells larger or the seabed smaller"},
      {head + "[seafloor.ripples]\nrms_height_m = 0.1\nwavelength_m = 0.5",
       "s.toml:4:16: ripples of 0.5 m need cells of 0.125 m or less, and seafloor.cell_m is 0.2"},
      {head + "[track]\npings = 1_000_000",
       "s.toml:3:9: 1000000 pings make 3e+09 pixels, expected at most 1e+09: use fewer pings or "
       "bins"},
  }));
  CHECK(error_of(text) == message);
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

TEST_CASE("An override is read as TOML, a bare word as a string, and errors name it") {
  const Scene scene = parsed(
      head + "[track]\npings = 3\n",
      {"track.pings=5", "track.pings=6", "display.palette=copper", "sea.sound_speed_mps = 1500",
       "sonar.sidescan.bins=9", "seafloor.fractal={hurst=0.5}"});
  CHECK(scene.track.pings == 6);
  CHECK(scene.display.palette == Palette::copper);
  CHECK(scene.sea.sound_speed_mps == 1500.0);
  CHECK(scene.sonars[0].bins == 9);
  CHECK(scene.seafloor.fractal.hurst == 0.5);
  struct Case {
    std::string text, message;
  };
  const auto [text, message] = GENERATE(values<Case>({
      {"track.pings=1.2.3",
       "-D track.pings=1.2.3: 'track.pings' is the string \"1.2.3\", expected a whole number from "
       "1 "
       "to 10000000"},
      {"track.ping=3", "-D track.ping=3: unknown key \"ping\" in [track]; did you mean 'pings'?"},
      {"pings=3", "-D pings=3: unknown key \"pings\"; did you mean 'track.pings'?"},
      {"sonar.sidescna.bins=3",
       "-D sonar.sidescna.bins=3: the scene has no sonar \"sidescna\", expected one of sidescan; "
       "did "
       "you mean 'sidescan'?"},
      {"track.pings", "-D track.pings: expected key=value, as in -D sea.temperature_c=12"},
      {"=3", "-D =3: expected key=value, as in -D sea.temperature_c=12"},
      {"#a=3", "-D #a=3: expected key=value, as in -D sea.temperature_c=12"},
      {"seed=1\nspeckle=false", "-D: expected one line of text without control characters"},
      {"sonar.sidescan.sector_low_deg=100",
       "s.toml: 'sonar.sidescan.sector_high_deg' is 90, expected more than sector_low_deg, which "
       "is "
       "100; with -D sonar.sidescan.sector_low_deg=100"},
      {"sonar.sidescan.sector_high_deg=-20",
       "-D sonar.sidescan.sector_high_deg=-20: 'sonar.sidescan.sector_high_deg' is -20, expected "
       "more than sector_low_deg, which is -10"},
  }));
  CHECK(error_of(head, {text}) == message);
  CHECK(error_of(head, {"a b=1"}).starts_with("-D a b=1: "));
  CHECK(error_of(head, {"seed=\xff"}).starts_with("-D seed=\xff: "));
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

TEST_CASE("An override of what the scene does not have is answered with what to add") {
  CHECK(error_of([] {
          parse_scene("version = 1\n", "s.toml", std::vector<std::string>{"objects.0.height_m=2"},
                      {});
        }) == "-D objects.0.height_m=2: the scene has no [[objects]]; add one to the file");
  CHECK(error_of([] {
          parse_scene("version = 1\n", "s.toml", std::vector<std::string>{"material.q.like=sand"},
                      {});
        }) ==
        "-D material.q.like=sand: the scene has no material \"q\"; define it in the file, as "
        "[material.NAME]");
}

TEST_CASE("A scene's files lie under its folder or the data folder, and nowhere else") {
  TemporaryFolder folder;
  const fs::path scenes = folder / "scenes", data = folder / "data";
  fs::create_directories(scenes / "sub");
  fs::create_directories(data);
  for (const fs::path& file :
       {scenes / "a.tif", scenes / "sub/b.tif", data / "c.tif", folder / "out.tif"})
    write_text(file, "grid");
  fs::create_symlink(folder / "out.tif", scenes / "leads_out.tif");
  fs::create_symlink(folder.path(), scenes / "up");
  fs::create_symlink("sub/b.tif", scenes / "stays.tif");
  fs::create_symlink("/dev/zero", scenes / "zero");
  fs::create_symlink("loop", scenes / "loop");
  REQUIRE(mkfifo((scenes / "fifo").c_str(), 0600) == 0);
  const auto read = [&](const std::string& survey, const fs::path& data_folder) {
    write_text(scenes / "s.toml",
               head + "[seafloor]\nkind = \"survey\"\nsurvey = " + toml_string(survey) + "\n");
    return read_scene(scenes / "s.toml", {}, data_folder);
  };

  for (const auto& [name, file] :
       std::vector<std::pair<std::string, fs::path>>{{"a.tif", scenes / "a.tif"},
                                                     {"./sub/b.tif", scenes / "sub/b.tif"},
                                                     {"stays.tif", scenes / "sub/b.tif"},
                                                     {"data:c.tif", data / "c.tif"}}) {
    const Scene scene = read(name, data);
    CHECK(scene.seafloor.survey.name == name);
    CHECK(scene.seafloor.survey.path == fs::canonical(file));
    const std::string dumped = dump_scene(scene);
    CHECK(dumped.find(folder.path().string()) == std::string::npos);
    const Scene back = parse_scene(dumped, "dumped", {}, {scenes, data});
    CHECK(back.seafloor.survey.path == scene.seafloor.survey.path);
    CHECK(contents(back) == contents(scene));
  }

  const std::string start = (scenes / "s.toml").string() + ":4:10: 'seafloor.survey' names ";
  for (const auto& [name, why] : std::vector<std::pair<std::string, std::string>>{
           {"../out.tif",
            "expected a path under the scene's own folder, without '..', or data:path"},
           {"sub/../a.tif", "without '..'"},
           {"sub/..", "without '..'"},
           {"data:../out.tif", "without '..'"},
           {"data:/etc/passwd", "expected a path under"},
           {(scenes / "a.tif").string(), "expected a path under"},
           {"/dev/zero", "expected a path under"},
           {"/vsizip/a.zip", "expected a path under"},
           {"leads_out.tif", "a link leads out of"},
           {"up/out.tif", "a link leads out of"},
           {"up/data/c.tif", "a link leads out of"},
           {"zero", "a link leads out of"},
           {"fifo", "is not a regular file"},
           {"sub", "is a folder"},
           {".", "is a folder"},
           {"data:", "is a folder"},
           {"data:a.tif", "No such file"},
           {"missing.tif", "No such file"},
           {"a.tif/x", "Not a directory"},
           {"loop", "symbolic links"},
           {"vrt://a.tif", "No such file"},
           {std::string("a.tif\0x", 7), "NUL"},
           {std::string(5000, 'x'), "too long"},
           {"file:///etc/passwd", "No such file"},
           {"~/a.tif", "No such file"}}) {
    INFO(name);
    const std::string error = error_of([&, &its_name = name] { read(its_name, data); });
    CHECK(error.starts_with(start));
    CHECK(error.find(why) != std::string::npos);
  }
  CHECK(error_of([&] { read("data:c.tif", {}); }) ==
        start + "\"data:c.tif\": no data folder is known: give --data DIR or set ENSONIFY_DATA");

  // Back to a fractal bed from the command line.
  read("a.tif", {});
  const std::vector<std::string> away = {"seafloor.kind=fractal", "seafloor.survey="};
  CHECK(read_scene(scenes / "s.toml", away).seafloor.survey.name.empty());
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
             sonar.receiver.spreading == 30.0 && sonar.receiver.bed_level_db == -12.0 &&
             sonar.receiver.output_noise_db == -42.0;
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

  // A recorded track has its own motion. A dump reads back as the same scene.
  const std::string of_file = "[track]\nkind = \"file\"\nfile = \"a.csv\"\n";
  const std::string text = head + "conditions = \"survey\"\n" + of_file + two;
  CHECK(parse_recipe_unchecked(text, "s.toml", {}).motion.roll.is_zero());
  CHECK(dump_scene(parsed(dump_scene(by_preset))) == dump_scene(by_preset));
}

TEST_CASE("Options of a track that do not fit each other are refused") {
  CHECK(error_of(head + "[track]\nkind = \"file\"") ==
        "s.toml:3:8: 'track.kind' is \"file\", but no file is named: give it as track.file");
  CHECK(error_of(head + "[track]\nfile = \"a.csv\"") ==
        "s.toml:3:8: 'track.file' needs track.kind = \"file\"");
  CHECK(error_of(head + "[track]\norigin_lat_deg = 50").starts_with("s.toml:3:18: of "));
  CHECK(error_of(head + "[track]\nkind = \"lawn-mower\"\nspeed_mps = 0")
            .starts_with("s.toml:4:13: 'track.speed_mps' is 0, "));
}

TEST_CASE("The reference page has a row for every key") {
  const std::string page = schema_text();
  for (const auto& section : scene_sections())
    for (const auto& key : section.keys)
      CHECK(page.find(fmt::format("| `{}` | {} | {} |", key.name, key.help, expectation(key))) !=
            std::string::npos);
  for (const auto& key : sonar_section().keys)
    CHECK(page.find(fmt::format("| `{}` | {} |", key.name, key.help)) != std::string::npos);
}

TEST_CASE("A start time means the same with and without quotes") {
  const auto start_of = [](const std::string& time) {
    return parsed("version = 1\n[output]\nstart_time = " + time + "\n").output.start_time;
  };
  CHECK(start_of("\"2025-06-01T12:00:00Z\"") == "2025-06-01T12:00:00Z");
  CHECK(start_of("2025-06-01T12:00:00Z") == "2025-06-01T12:00:00Z");
}
