#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iterator>
#include <set>
#include <thread>
#include <utility>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/small_recording.h"
#include "support/tiny_recipe.h"
#include "support/tiny_scene.h"
#include "support/tree.h"

#include <ensonify/engine/output/xtf.h>
#include <ensonify/engine/scene/dump.h>
#include <ensonify/refine/printable.h>

using namespace ensonify;
using namespace ensonify::tests;
namespace fs = std::filesystem;

namespace {

const std::string no_repairs =
    "repairs 0\nrepair_welded_vertices 0\nrepair_degenerate_faces 0\nrepair_duplicate_faces 0\n"
    "repair_non_manifold_edges 0\nrepair_unorientable_edges 0\nrepair_split_vertices 0\n"
    "repair_flipped_faces 0\nrepair_unreferenced_vertices 0\n";

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Checks a row of `ensonify trace`: ray, hit, face, t, u, v and the normal.
void check_hit(const std::string& line, std::vector<double> expected) {
  std::vector<double> values;
  std::istringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) values.push_back(std::stod(field));
  INFO(line);
  REQUIRE(values.size() == expected.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    CHECK(values[i] == Approx(expected[i]).epsilon(1e-6).margin(1e-6));  // Embree computes in float
}

/// Checks that a program printed one message and nothing else.
void check_refused(const Outcome& outcome, int code, const std::string& message) {
  INFO(outcome.err);
  CHECK(outcome.code == code);
  CHECK(outcome.out.empty());
  CHECK(outcome.err.starts_with("ensonify: "));
  CHECK(std::ranges::count(outcome.err, '\n') == 1);
  CHECK(outcome.err.find(message) != std::string::npos);
}

/// SIGTERM after a time ends the program within 10 s, with one message and nothing left behind but
/// its scene, tiny.toml.
void check_stops(const TemporaryFolder& folder, const std::vector<std::string>& words,
                 std::chrono::seconds after) {
  std::chrono::steady_clock::time_point killed;
  const Outcome outcome = run_program(folder.path(), words, {}, [&](pid_t process) {
    std::this_thread::sleep_for(after);
    kill(process, SIGTERM);
    killed = std::chrono::steady_clock::now();
  });
  CHECK(std::chrono::steady_clock::now() - killed < std::chrono::seconds(10));
  check_refused(outcome, 128 + SIGTERM, "stopped");
  CHECK(names_in(folder.path()) == std::set<std::string>{"tiny.toml"});
}

}  // namespace

TEST_CASE("Help goes to stdout, and a wrong command line gets one message and exit code 2") {
  const TemporaryFolder folder;
  const Outcome help = run_program(folder.path(), {"--help"});
  CHECK(help.code == 0);
  CHECK(help.err.empty());
  for (const std::string command :
       {"run", "mosaic", "check", "seafloor", "trace", "mesh-info", "recording-info", "compare",
        "imitate", "backscatter", "sediments", "presets", "water", "dump-default", "schema",
        "intersectors"}) {
    CHECK(help.out.find("\n  " + command + " ") != std::string::npos);
    const Outcome own = run_program(folder.path(), {command, "--help"});
    CHECK(own.code == 0);
    CHECK(own.out.find(command) != std::string::npos);
  }
  const std::string further = "Ctrl-C";  // the list has only the first sentence of a description
  CHECK(help.out.find(further) == std::string::npos);
  CHECK(run_program(folder.path(), {"check", "--help"}).out.find(further) != std::string::npos);
  const Outcome asked = run_program(folder.path(), {"help"});
  CHECK(asked.code == 0);
  CHECK(asked.out == help.out);
  CHECK(run_program(folder.path(), {"help", "mosaic"}).out ==
        run_program(folder.path(), {"mosaic", "--help"}).out);
  check_refused(run_program(folder.path(), {"help", "rum"}), 2, "rum");
  check_refused(run_program(folder.path(), {}), 2, "a subcommand is required");
  check_refused(run_program(folder.path(), {"rum"}), 2, "rum");
  check_refused(run_program(folder.path(), {"run"}), 2, "SCENE is required");
  check_refused(run_program(folder.path(), {"run", "s.toml", "--fast"}), 2, "--fast");
  check_refused(run_program(folder.path(), {"run", "s.toml", "--threads", "0"}), 2, "--threads");
  check_refused(run_program(folder.path(), {"dump-default", "everything"}), 2, "everything");
  check_refused(run_program(folder.path(), {"run", "none.toml"}), 2,
                "none.toml: there is no such file; correct the path");
  CHECK(fs::is_empty(folder.path()));
}

TEST_CASE("Every command that makes a seafloor takes a memory limit, and a cache if it analyses") {
  const TemporaryFolder folder;
  const auto takes = [&](const std::string& command, const std::string& option) {
    CAPTURE(command, option);
    CHECK(run_program(folder.path(), {command, "--help"}).out.find("\n  " + option + " ") !=
          std::string::npos);
  };
  for (const std::string command :
       {"run", "stream", "live", "generate", "preview", "analyse", "check", "view"}) {
    takes(command, "--memory");
    takes(command, "--cache");
  }
  takes("seafloor", "--memory");
}

TEST_CASE("A number of the command line is neither NaN nor nothing, and within its short bounds") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::vector<std::string>& arguments, const std::string& message) {
    CAPTURE(arguments);
    const Outcome outcome = run_program(folder.path(), arguments);
    check_refused(outcome, 2, message);
    CHECK(outcome.err.size() < 160);
  };
  const auto words = [](const std::string& line) {
    std::istringstream stream(line);
    return std::vector<std::string>(std::istream_iterator<std::string>(stream), {});
  };
  for (const std::string value : {"nan", "-nan", "", "x", "-1e400", "inf"}) {
    for (const auto& [line, message] :
         {std::pair<std::string, std::string>{"compare a b --limit", " from 0 to 1000000 "},
          {"live scene.toml --pings-per-s", " from 0 to 10000 "},
          {"mosaic run -o mosaic.tif --pixel-m", " from 1e-09 to 1000000 "},
          {"ray --profile cast.csv --source-depth-m 1 --range-m 1 --launch-deg",
           " from -89.999 to 89.999 "},
          {"ray --profile cast.csv --source-depth-m 1 --launch-deg 1 --range-m",
           " from 1e-06 to 10000000 "},
          {"ray --profile cast.csv --source-depth-m", " from 0 to 12000 "},
          {"sediments --mean-grain-size-phi", " "},
          {"backscatter --sound-speed-mps 1500 --frequency-hz", " from 1 to 1000000000 "},
          {"water --salinity-psu 35 --depth-m 1 --temperature-c", " "}}) {
      std::vector<std::string> arguments = words(line);
      arguments.push_back(value);
      refused(arguments, arguments[arguments.size() - 2] + ": '" + value + "' is not a number" +
                             message + "(see ensonify " + arguments.front());
    }
  }
  refused(words("mosaic run -o mosaic.tif --pixel-m -1"), "'-1' is not a number from 1e-09 to");
  // CLI11 writes the range as "1 to 1000000000", from 2.4 on as "[1 - 1000000000]".
  refused(words("view scene.toml -o view.png --ping -1"), "--ping: Value -1 not in range ");
  refused({"imitate", "line.xtf", "-o", "out", "--line", ""}, "--line: Value  not in range ");
  for (const std::string line : {"run scene.toml", "generate recipe.toml", "imitate line.xtf",
                                 "view scene.toml", "mosaic run", "seafloor scene.toml"}) {
    std::vector<std::string> arguments = words(line);
    arguments.insert(arguments.end(), {"-o", ""});
    refused(arguments, "--output: the path is empty; name one");
  }
}

TEST_CASE("Unexpected arguments are listed in their order, with a suggestion") {
  const TemporaryFolder folder;
  const auto refused = [&](std::vector<std::string> arguments, const std::string& message) {
    check_refused(run_program(folder.path(), std::move(arguments)), 2, message);
  };
  refused({"run", "s.toml", "one", "two", "three"},
          "not expected: one two three (see ensonify run --help)");
  refused({"rnu", "s.toml", "two"}, "not expected: rnu s.toml two; did you mean 'run'?");
  refused({"s.toml"}, "not expected: s.toml; did you mean 'run s.toml'?");
  refused({"run", "s.toml", "--thread", "2"},
          "not expected: --thread 2; did you mean '--threads'?");
  refused({"--quiet", "run", "s.toml"}, "not expected: --quiet");
  refused({"run", "s.toml", "--threads", "-1"}, "--threads");
  refused({"live", "s.toml", "--port", "-1"}, "--port");
  refused({"live", "s.toml", "--port", "65536"}, "--port");
  refused({"view", "s.toml", "-o", "v.png", "--ping", "-1"}, "--ping");
  refused({"check", "s.toml", "--rays", "-5"}, "--rays");
  refused({"preview", "s.toml", "-o", "v.png", "-n", "-1"}, "-n");
  refused({"generate", "s.toml", "-o", "d", "--shard", "-1/2"}, "--shard -1/2");
  refused({"run", "s.toml", "--seed", "abc"}, "s.toml");
}

TEST_CASE("The option --version prints the program's version and those of its libraries") {
  const TemporaryFolder folder;
  const Outcome printed = run_program(folder.path(), {"--version"});
  CHECK(printed.code == 0);
  CHECK(printed.err.empty());
  write_text(folder / "tiny.toml", tiny_scene);
  REQUIRE(run_program(folder.path(), {"run", "tiny.toml", "-o", "out", "--quiet"}).code == 0);
  const auto manifest = nlohmann::json::parse(read_text(folder / "out/manifest.json"));
  const std::vector<std::string> lines = lines_of(printed.out);
  REQUIRE(lines.size() == 1 + manifest["libraries"].size());
  CHECK(lines.front() == "ensonify " + manifest["version"].get<std::string>());
  for (const auto& [library, version] : manifest["libraries"].items())
    CHECK(std::ranges::count(lines, library + " " + version.get<std::string>()) == 1);
}

TEST_CASE("Extrapolated levels give one line per run on stderr, and none with --quiet") {
  const TemporaryFolder folder;
  write_text(folder / "high.toml",
             tiny_scene +
                 "[sonar.higher]\nfrequency_hz = 900000\nrange_m = 15\nbins = 100\n"
                 "elevations = 128\n[[objects]]\nshape = \"boulder\"\n"
                 "material = \"rock\"\neast_m = 5\n[[objects]]\nshape = \"barrel\"\n"
                 "[[seafloor.patches]]\nmaterial = \"clay\"\nradius_m = 3\n");
  const auto lines_with = [](const std::string& text, const std::string& word) {
    return std::ranges::count_if(lines_of(text), [&](const std::string& line) {
      return line.find(word) != std::string::npos;
    });
  };
  const Outcome plain = run_program(folder.path(), {"run", "high.toml", "-o", "a"});
  INFO(plain.err);
  REQUIRE(plain.code == 0);
  CHECK(lines_with(plain.err, "kHz") == 1);
  CHECK(lines_with(plain.err,
                   "ensonify: warning: levels are extrapolated, expected within 10 dB: the bottom "
                   "model is validated from 10 to 100 kHz, and used at 400 to 900 kHz for rock") ==
        1);
  const Outcome quiet =
      run_program(folder.path(), {"run", "high.toml", "-o", "b", "--quiet", "--json"});
  CHECK(quiet.code == 0);
  CHECK(lines_of(quiet.err).size() == 1);
  CHECK(lines_with(quiet.err, "extrapolated") == 1);
  CHECK(nlohmann::json::parse(quiet.out)["warnings"].size() == 1);
  const auto manifest = nlohmann::json::parse(read_text(folder / "b/manifest.json"));
  REQUIRE(manifest["warnings"].size() == 1);
  CHECK(manifest["warnings"][0].get<std::string>().starts_with("levels are extrapolated"));
  // Mud and sand are ordinary at these frequencies.
  const Outcome ordinary = run_program(
      folder.path(), {"run", "high.toml", "-o", "d", "-D", "objects.0.material=medium sand"});
  CHECK(ordinary.code == 0);
  CHECK(lines_with(ordinary.err, "warning") == 0);
  // Within the model's range there is no warning.
  for (const std::string frequency : {"sonar.left-right.frequency_hz=100000"})
    CHECK(run_program(folder.path(), {"run", "high.toml", "-o", "c", "-D", frequency, "-D",
                                      "sonar.higher.frequency_hz=10000"})
              .err.find("extrapolated") == std::string::npos);

  write_text(folder / "poses", "{\"x_m\": 0, \"y_m\": 0, \"z_m\": -12}\n");
  for (const bool silent : {false, true}) {
    std::vector<std::string> arguments{"stream", "high.toml", "--json"};
    if (silent) arguments.emplace_back("--quiet");
    const Outcome streamed = run_program(folder.path(), arguments, {}, {}, {}, folder / "poses");
    CHECK(streamed.code == 0);
    CHECK(lines_with(streamed.err, "extrapolated") == 1);
  }
}

TEST_CASE("The default scene, the key table and the intersectors are printed") {
  const TemporaryFolder folder;
  const Outcome scene = run_program(folder.path(), {"dump-default", "run"});
  CHECK(scene.code == 0);
  CHECK(scene.out == ensonify::engine::dump_scene({}));
  CHECK(run_program(folder.path(), {"schema"}).out == ensonify::engine::schema_text());
  CHECK(run_program(folder.path(), {"intersectors"}).out.find("brute_force ") != std::string::npos);
  const Outcome full = run_program(folder.path(), {"schema"}, {}, {}, "/dev/full");
  CHECK(full.code == 1);
  CHECK(
      full.err ==
      "ensonify: stdout: not all of the output could be written; check the disk, or the program that "
      "reads it\n");
}

TEST_CASE("A run writes its files, reports on stderr, and as JSON on stdout when asked") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const std::set<std::string> files = {"left-right.exr", "left-right.png", "left-right_pings.csv",
                                       "manifest.json"};

  const Outcome plain = run_program(folder.path(), {"run", "tiny.toml"});
  INFO(plain.err);
  CHECK(plain.code == 0);
  CHECK(plain.out.empty());
  CHECK(plain.err.find("\n9 pings in ") != std::string::npos);
  CHECK(plain.err.find("pings/s") != std::string::npos);
  CHECK(plain.err.find("picture: tiny-run/left-right.png\n") != std::string::npos);
  CHECK(names_in(folder / "tiny-run") == files);

  const Outcome json = run_program(
      folder.path(), {"run", "-D", "track.pings=5", "-D", "seafloor.cell_m=4", "tiny.toml",
                      "-Doutput.npz=true", "--json", "--quiet", "-o", "deep/out", "--threads", "2",
                      "--seed", "7", "--intersector", "brute_force", "--surface", "static"});
  INFO(json.err);
  CHECK(json.code == 0);
  CHECK(json.err.empty());
  const auto report = nlohmann::json::parse(json.out);
  CHECK(report["counts"]["pings"] == 5);
  CHECK(report["threads"] == 2);
  CHECK(report["pings_per_s"] > 0.0);
  CHECK(report["stages_s"]["trace"] > 0.0);
  CHECK(report["stages_s"].value("receiver", 0.0) > 0.0);
  CHECK(report["stages_s"]["speckle"] == report["stages_s"]["receiver"]);
  CHECK(report["files"].size() == 5);
  for (const std::string file : report["files"]) CHECK(fs::is_regular_file(folder / file));
  const auto manifest = nlohmann::json::parse(read_text(folder / "deep/out/manifest.json"));
  CHECK(manifest["seed"] == 7);
  CHECK(manifest["code_path"]["intersector"] == "brute_force");
  CHECK(manifest.dump().find(folder.path().string()) == std::string::npos);
}

TEST_CASE("A fault of a scene is reported once, and nothing is left behind") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text, std::vector<std::string> more, int code,
                           const std::string& message) {
    write_text(folder / "s.toml", text);
    more.insert(more.begin(), {"run", "s.toml", "-o", "out"});
    check_refused(run_program(folder.path(), more), code, message);
    CHECK(names_in(folder.path()) == std::set<std::string>{"s.toml"});
  };
  refused(tiny_scene + "[trak]\n", {}, 2,
          "ensonify: s.toml:17:2: unknown key \"trak\"; did you mean 'track'?\n");
  refused(tiny_scene, {"-D", "track.pings=0"}, 2, "ensonify: -D track.pings=0: 'track.pings' is 0");
  refused(tiny_scene, {"--seed", "-1"}, 2, "'seed' is -1, expected a whole number from 0");
  refused(tiny_scene, {"--surface", "refine"}, 2, "did you mean 'refined'");
  refused(tiny_scene, {"--intersector", "embre"}, 2, "did you mean 'embree'?");
  refused(tiny_scene, {"-D", "track.middle_east_m=1000"}, 2, "off the seafloor");
  refused(tiny_scene, {"-D", "track.altitude_m=30"}, 2, "above the sea surface");
  refused(tiny_scene, {"-D", "seafloor.kind=survey", "-D", "seafloor.survey=/dev/zero"}, 2,
          "expected a path under the scene's own folder");
  refused(tiny_scene, {"-D", "seafloor.kind=survey", "-D", "seafloor.survey=data:grid.asc"}, 2,
          "give --data DIR or set ENSONIFY_DATA");
  refused(tiny_scene, {"-D", "seafloor.kind=survey", "-D", "seafloor.survey=s.toml"}, 2,
          "s.toml: ");

  write_text(folder / "file", "");  // a folder cannot be made inside a file
  const Outcome blocked = run_program(folder.path(), {"run", "s.toml", "-o", "file/out"});
  check_refused(blocked, 1, "ensonify: file/out: cannot make this folder; ");
  CHECK(blocked.err.find("filesystem error") == std::string::npos);
  if (geteuid() != 0) {  // root can write anywhere
    fs::create_directory(folder / "locked");
    fs::permissions(folder / "locked", fs::perms::owner_read | fs::perms::owner_exec);
    check_refused(
        run_program(folder.path(), {"run", "s.toml", "-o", "locked"}), 1,
        "ensonify: locked: cannot write into this folder; choose a folder that you may write to");
  }
  const Outcome dataset = run_program(folder.path(), {"merge", "none"});
  check_refused(dataset, 2, "ensonify: none: there is no such folder; expected a folder made by");
  fs::create_directory(folder / "empty");
  check_refused(run_program(folder.path(), {"merge", "empty"}), 2,
                "ensonify: empty: there is no dataset.json in it; expected a folder made by");
  check_refused(run_program(folder.path(), {"merge", "file"}), 2, "file: there is no such folder");
}

TEST_CASE("A file that is no scene is named by its kind, with how a scene takes it") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  REQUIRE(run_program(folder.path(), {"analyse", "tiny.toml", "-o", "bed", "--quiet"}).code == 0);
  const engine::Recording recording = small_recording();
  write_text(folder / "line.xtf", as_text(engine::encode_xtf({&recording, 1})));
  write_text(folder / "crate.stl", "solid\n");
  write_text(folder / "heights.asc", "NCOLS 2\nNROWS 2\nXLLCORNER 0\nYLLCORNER 0\nCELLSIZE 1\n");
  write_text(folder / "heights.tif", std::string("II*\0", 4) + std::string(2'000'000, '\0'));
  struct Case {
    std::string file, kind, how;
  };
  for (const auto& [file, kind, how] : {Case{"bed", "a progressive mesh", "progressive = "},
                                        {"crate.stl", "a mesh", "mesh = "},
                                        {"heights.asc", "a survey grid", "survey = "},
                                        {"heights.tif", "a survey grid", "survey = "},
                                        {"line.xtf", "a recording", "imitate"}})
    for (const std::string command : {"run", "analyse", "generate"}) {
      if (command == "analyse" && kind == "a mesh") continue;  // which it takes
      CAPTURE(command);
      const Outcome outcome = run_program(folder.path(), {command, file, "-o", "out"});
      check_refused(outcome, 2, file + ": is " + kind + ", expected a scene");
      CHECK(outcome.err.find(how) != std::string::npos);
      CHECK_FALSE(fs::exists(folder / "out"));
    }
  write_text(folder / "rays.csv", "ox,oy,oz,dx,dy,dz\n");
  check_refused(run_program(folder.path(), {"trace", "bed", "rays.csv"}), 2,
                "bed: is an analysed seafloor, expected a mesh or a survey grid");
  write_text(folder / "wrong.toml",
             "version = 1\n[seafloor]\nkind = \"survey\"\nsurvey = \"crate.stl\"\n");
  check_refused(run_program(folder.path(), {"run", "wrong.toml", "-o", "out"}), 2,
                "crate.stl: is a mesh, expected a survey grid");
}

TEST_CASE("A path that the system refuses, or an empty one, is named in the program's own words") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const std::string longer(300, 'n');  // than the name of a file can be
  fs::create_symlink("circle", folder / "circle");
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"run", "tiny.toml", "-o", longer},
        {"merge", longer},
        {"compare", longer, longer},
        {"mosaic", longer, "-o", "map.tif"}})
    check_refused(run_program(folder.path(), arguments), 1,
                  ": File name too long; correct the path");
  check_refused(run_program(folder.path(), {"run", "tiny.toml", "-o", "circle"}), 1,
                "circle/manifest.json: Too many levels of symbolic links; correct the path");
  check_refused(run_program(folder.path(), {"compare", "a.xtf", "b.xtf", "--html", ""}), 2,
                "--html: the path is empty");
}

TEST_CASE("Text from outside does nothing to the terminal on which a message repeats it") {
  const TemporaryFolder folder;
  const std::string name = "größe\x1b[31m\n\x7f\xc2\x9b\xe9";
  const std::string shown = "größe\\x1B[31m\\x0A\\x7F\\xC2\\x9B\\xE9";
  write_text(folder / (name + ".toml"), "version = 1\n\"größe\\u001b[31m\\u009b\" = 1\n");
  write_text(folder / (name + ".obj"), "v 0 0 größe\x1b[31m\n");
  write_text(folder / "tiny.toml", tiny_scene);
  const auto check = [&](const std::vector<std::string>& arguments, const std::string& message) {
    const Outcome outcome = run_program(folder.path(), arguments);
    CAPTURE(arguments, outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.err.find(message) != std::string::npos);
    CHECK(refine::printable(outcome.err, "\n") == outcome.err);
    CHECK(std::ranges::count(outcome.err, '\n') == 1);
  };
  check({"run", name, "-o", "out"}, "ensonify: " + shown + ": there is no such file");
  check({"run", name + ".toml", "-o", "out"}, shown + ".toml:2:1: unknown key \"größe\\u001B[31m");
  check({"run", "tiny.toml", "-o", "out", "--" + name}, shown);
  check({"run", "tiny.toml", "-o", "out", "-D", "track.pings=größe"}, "\"größe\"");
  check({"run", "tiny.toml", "-o", "out", "-D", "track.pings=\xe9"}, "-D track.pings=\\xE9: ");
  check({name}, shown);
  check({"mesh-info", name + ".obj"}, shown + ".obj:1: found \"größe\\x1B[31m\"");
  check({"merge", name}, "ensonify: " + shown + ": there is no such folder");
  check({"recording-info", name + ".obj"}, shown);
}

TEST_CASE("Text that is deep in itself is refused by every command that reads it") {
  const TemporaryFolder folder;
  std::string key = "a";
  for (int i = 1; i < 31000; ++i) key += ".a";
  write_text(folder / "tiny.toml", tiny_scene);
  write_text(folder / "recipe.toml", tiny_recipe);
  write_text(folder / "key.toml", "version = 1\n" + key + " = 1\n");
  write_text(folder / "table.toml", "version = 1\n[" + key + "]\n");
  for (const char* scene : {"key.toml", "table.toml"})
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"run", scene, "-o", "out"},
          {"generate", scene, "-o", "out"},
          {"stream", scene}})
      check_refused(run_program(folder.path(), arguments), 2, "more than 64 deep in each other");
  for (const auto& [command, file] :
       {std::pair{"run", "tiny.toml"}, {"generate", "recipe.toml"}, {"stream", "tiny.toml"}}) {
    std::vector<std::string> arguments{command, file, "-D", key + "=1"};
    if (command != std::string("stream")) arguments.insert(arguments.end(), {"-o", "out"});
    check_refused(run_program(folder.path(), arguments), 2,
                  "...: keys, tables and lists are more than 64 deep in each other");
  }
  fs::create_directory(folder / "dataset");
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  write_text(folder / "dataset/dataset.json", "{\"a\": " + deep + "}");
  check_refused(run_program(folder.path(), {"merge", "dataset"}), 2,
                "this JSON has lists or objects more than 64 levels deep, from byte 70 on");
}

TEST_CASE("A survey is found under --data and ENSONIFY_DATA") {
  const TemporaryFolder folder;
  std::string grid =
      "ncols 60\nnrows 40\nxllcorner 400000\nyllcorner 6200000\ncellsize 1\nnodata_value -9999\n";
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 60; ++column) grid += "-20.5 ";
    grid += '\n';
  }
  fs::create_directory(folder / "d");
  write_text(folder / "d/grid.asc", grid);
  write_text(folder / "s.toml",
             "version = 1\n[seafloor]\nkind = \"survey\"\nsurvey = \"data:grid.asc\"\n"
             "[track]\npings = 2\n[sonar.a]\nbins = 50\nelevations = 64\n");
  CHECK(run_program(folder.path(), {"run", "s.toml", "--data", "d", "-o", "a"}).code == 0);
  CHECK(run_program(folder.path(), {"run", "s.toml", "-o", "b"}, {"ENSONIFY_DATA=d"}).code == 0);
  CHECK(read_text(folder / "a/manifest.json") == read_text(folder / "b/manifest.json"));
  CHECK(read_text(folder / "a/manifest.json").find("data:grid.asc") != std::string::npos);

  // The same grid, traced: a ray straight down in the grid's coordinates.
  const Outcome info = run_program(folder.path(), {"mesh-info", "d/grid.asc"});
  CHECK(info.out ==
        "vertices 2400\ntriangles 4602\nx_min 400000.5\nx_max 400059.5\ny_min 6200000.5\n"
        "y_max 6200039.5\nz_min -20.5\nz_max -20.5\nboundary_edges 196\n"
        "non_manifold_edges 0\n" +
            no_repairs + "columns 60\nrows 40\ncell_east_m 1\ncell_north_m 1\nholes 0\n");
  write_text(folder / "r.csv", "ox,oy,oz,dx,dy,dz\n400001.25,6200001,0,0,0,-2\n");
  const Outcome hit = run_program(folder.path(), {"trace", "d/grid.asc", "r.csv"});
  check_hit(lines_of(hit.out).at(1), {0, 1, 0, 10.25, 0.25, 0.5, 0, 0, 1});
}

TEST_CASE("A run that is stopped removes its files and exits with 128 plus the signal's number") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const auto stopped_by = [&](int signal, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"run",       "tiny.toml",
                                       "-o",        "new/folders/out",
                                       "--threads", "1",
                                       "-D",        "track.pings=40000",
                                       "-D",        "track.speed_mps=0",
                                       "-D",        "run.block_pings=2",
                                       "-D",        "sonar.left-right.elevations=65536"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(folder.path(), arguments, {}, [&](pid_t process) {
      const fs::path picture = folder / "new/folders/out/left-right.png";
      for (int i = 0; i < 1000 && !fs::exists(picture); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      CHECK(fs::exists(picture));  // the picture grows during the run
      kill(process, signal);
      kill(process, signal);
    });
  };
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGXCPU, SIGUSR1, SIGUSR2}) {
    check_refused(stopped_by(signal, {}), 128 + signal, "stopped");
    CHECK(names_in(folder.path()) == std::set<std::string>{"tiny.toml"});
  }
  const Outcome with_json = stopped_by(SIGTERM, {"--json"});
  CHECK(with_json.code == 128 + SIGTERM);
  CHECK(with_json.out == "{\n  \"folder\": \"new/folders/out\",\n  \"stopped\": true\n}\n");
}

TEST_CASE("Making a bed, which takes minutes, is stopped by SIGTERM at once") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene + "[[seafloor.boulders]]\nper_hectare = 1e5\n");
  using Words = std::vector<std::string>;
  for (Words words : {Words{"run", "-o", "out"}, Words{"view", "-o", "out.png"},
                      Words{"seafloor", "-o", "out.npy"}, Words{"analyse", "-o", "out.pm"}}) {
    CAPTURE(words.front());
    words.insert(words.begin() + 1, "tiny.toml");
    for (const char* key : {"extent_east_m=300", "extent_north_m=300", "cell_m=0.1"})
      words.insert(words.end(), {"-D", std::string("seafloor.") + key});
    check_stops(folder, words, std::chrono::seconds(2));
  }
}

TEST_CASE("The exact reference's tree, which takes long to make, is stopped by SIGTERM at once") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  std::vector<std::string> words{
      "run", "tiny.toml", "-o", "out", "--quiet", "--surface=static", "--intersector=pluecker"};
  for (const char* key : {"extent_east_m=100", "extent_north_m=100", "cell_m=0.05"})
    words.insert(words.end(), {"-D", std::string("seafloor.") + key});
  for (const int after_s : {2, 4}) check_stops(folder, words, std::chrono::seconds(after_s));
}

TEST_CASE("A ping that takes minutes, and many objects, are stopped by SIGTERM at once") {
  using Words = std::vector<std::string>;
  for (const auto& [more, words] : std::vector<std::pair<std::string, Words>>{
           {"", {"-D", "seafloor.cell_m=0.04", "--surface=static", "--intersector=brute_force"}},
           {"[[objects]]\nshape = \"tyre\"\ncount = 20000\n",
            {"-D", "seafloor.extent_east_m=400", "-D", "seafloor.extent_north_m=400"}}}) {
    CAPTURE(more);
    const TemporaryFolder folder;
    write_text(folder / "tiny.toml", tiny_scene + more);
    Words all{"run", "tiny.toml", "-o", "out", "--quiet"};
    all.insert(all.end(), words.begin(), words.end());
    check_stops(folder, all, std::chrono::seconds(4));
  }
}

TEST_CASE("A signal ends a program that waits for a reader of its output") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  REQUIRE(mkfifo((folder / "address").c_str(), 0600) == 0);
  const int nobody_reads = open((folder / "address").c_str(), O_RDWR | O_NONBLOCK);
  const std::string full(4096, 'x');
  while (write(nobody_reads, full.data(), full.size()) > 0) {
  }
  const Outcome outcome = run_program(
      folder.path(), {"live", "tiny.toml", "--quiet"}, {},
      [](pid_t process) {
        std::this_thread::sleep_for(std::chrono::seconds(3));
        kill(process, SIGTERM);
      },
      folder / "address");
  close(nobody_reads);
  if (outcome.err.find("has no live view") == std::string::npos)
    CHECK(outcome.code == 128 + SIGTERM);
}

TEST_CASE("A closed stdin is an empty one, and a closed stdout cannot be written") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const auto code_of = [&](const std::string& redirection) {
    const std::string line = "cd '" + folder.path().string() + "' && timeout 60 '" +
                             program_file().string() + "' stream tiny.toml --quiet 2>err " +
                             redirection;
    const int status = std::system(line.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  CHECK(code_of("<&- >out") == 0);
  CHECK(read_text(folder / "out").starts_with("{\"protocol\""));
  CHECK(code_of("<&- >&-") == 1);
  CHECK(read_text(folder / "err").find("stdout: not all") != std::string::npos);
}

TEST_CASE("A run is made as ever if stderr cannot be written") {
  if (!fs::exists("/dev/full")) {
    WARN("skipped: this system has no /dev/full");
    return;
  }
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  REQUIRE(run_program(folder.path(), {"run", "tiny.toml", "-o", "plain"}).code == 0);
  CHECK(std::system(("cd '" + folder.path().string() + "' && '" + program_file().string() +
                     "' run tiny.toml -o full 2> /dev/full")
                        .c_str()) == 0);
  CHECK(difference(tree_of(folder / "full"), tree_of(folder / "plain")) == "");
}

TEST_CASE("A seafloor is written as a mesh, described by mesh-info, and hit by rays") {
  const TemporaryFolder folder;
  write_text(folder / "flat.toml",
             "version = 1\n[seafloor]\nextent_east_m = 4\nextent_north_m = 2\ncell_m = 1\n"
             "depth_m = 20\n[seafloor.fractal]\nheight_at_1m_m = 0\n");
  REQUIRE(run_program(folder.path(), {"seafloor", "flat.toml", "-o", "flat.ply"}).code == 0);
  REQUIRE(run_program(folder.path(), {"seafloor", "flat.toml", "-o", "flat.npy"}).code == 0);
  REQUIRE(run_program(folder.path(), {"seafloor", "flat.toml", "-o", "UPPER.PLY"}).code == 0);
  CHECK(read_text(folder / "UPPER.PLY") == read_text(folder / "flat.ply"));
  CHECK(read_text(folder / "flat.npy").find("'shape': (3, 5)") != std::string::npos);
  check_refused(run_program(folder.path(), {"seafloor", "flat.toml", "-o", "flat.jpg"}), 2,
                ".ply, .npy or .tif");
  CHECK(run_program(folder.path(), {"mesh-info", "flat.ply"}).out ==
        "vertices 15\ntriangles 16\nx_min -2\nx_max 2\ny_min -1\ny_max 1\nz_min -20\nz_max -20\n"
        "boundary_edges 12\nnon_manifold_edges 0\n" +
            no_repairs);
  check_refused(run_program(folder.path(), {"mesh-info", "."}), 2, "is a folder");
  // A file of heights alone does not state the size of its cells.
  check_refused(run_program(folder.path(), {"mesh-info", "flat.npy"}), 2, "--survey-cell-m");
  const Outcome of_grid =
      run_program(folder.path(), {"mesh-info", "flat.npy", "--survey-cell-m", "1"});
  CHECK(of_grid.out.starts_with("vertices 15\ntriangles 16\nx_min -2\nx_max 2\n"));
  // A mesh above the sea can be analysed, under whatever name.
  write_text(folder / "up.obj", "v 0 0 1\nv 1 0 1\nv 0 1 2\nf 1 2 3\n");
  fs::create_directory(folder / "links");
  fs::create_symlink("../up.obj", folder / "links/up.obj");
  for (const std::string mesh : {"up.obj", "links/up.obj"})
    CHECK(run_program(folder.path(), {"analyse", mesh, "-o", "up.epm", "--quiet"}).code == 0);
  // The water level is the level of the analysis.
  write_text(folder / "up.toml",
             "version = 1\n[seafloor]\nkind = \"progressive\"\nprogressive = \"up.epm\"\n");
  check_refused(run_program(folder.path(), {"run", "up.toml", "-o", "up"}), 2, "analyse it again");
  CHECK(std::system(
            ("'" + program_file().string() + "' --version > /dev/full 2> /dev/null").c_str()) != 0);

  // Rays: downwards, upwards from below, a miss, one that ends too early, a slanted one.
  const std::string rays =
      "0.25,0.125,0,0,0,-1,0,inf\r\n0.25,0.125,-30,0,0,1,0,100\r\n50,0,0,0,0,-1,0,inf\r\n"
      "0,0,0,0,0,-1,0,19.9\r\n\r\n-1.5,0.25,-18,1,0,-1,0,1e3\r\n";
  write_text(folder / "rays.csv", "\xef\xbb\xbfox,oy,oz,dx,dy,dz,t_min,t_max\r\n" + rays);
  for (const std::string name : {"embree", "brute_force", "brute-force", "embree_single"}) {
    const Outcome traced =
        run_program(folder.path(), {"trace", "flat.ply", "rays.csv", "--intersector", name});
    INFO(traced.err);
    REQUIRE(traced.code == 0);
    const std::vector<std::string> lines = lines_of(traced.out);
    REQUIRE(lines.size() == 6);
    CHECK(lines[0] == "ray,hit,face,t,u,v,nx,ny,nz");
    // The first ray hits face 12 with the corners (0, 0), (1, 0), (1, 1). The normal is the same
    // from below.
    check_hit(lines[1], {0, 1, 12, 20, 0.125, 0.125, 0, 0, 1});
    check_hit(lines[2], {1, 1, 12, 10, 0.125, 0.125, 0, 0, 1});
    CHECK(lines[3] == "2,0,,,,,,,");
    CHECK(lines[4] == "3,0,,,,,,,");
    check_hit(lines[5], {4, 1, 12, 2, 0.25, 0.25, 0, 0, 1});
  }

  // Columns are found by name.
  write_text(folder / "rays.csv", "dz, dy, dx, oz, oy, ox\n-1, 0, 0, 0, 0.125, 0.25\n");
  check_hit(lines_of(run_program(folder.path(), {"trace", "flat.ply", "rays.csv"}).out).at(1),
            {0, 1, 12, 20, 0.125, 0.125, 0, 0, 1});

  const std::string header = "ox,oy,oz,dx,dy,dz\n";
  const auto refused = [&](const std::string& text, const std::string& message) {
    write_text(folder / "rays.csv", text);
    check_refused(run_program(folder.path(), {"trace", "flat.ply", "rays.csv"}), 2,
                  "ensonify: rays.csv:" + message);
  };
  refused("", "1: the file is empty");
  refused("ox,oy,oz,dx,dy\n", "1: no column dz");
  refused("ox,oy,oz,dx,dy,dz,t\n", " unknown column 't'");
  refused("ox,ox,oz,dx,dy,dz\n", "1: column ox appears twice");
  refused(header + "0,0,0,0,0,-1\n0,0,0,0,0\n", "3: 5 values in");
  refused(header + "0,0,zero,0,0,-1\n", "2: oz is 'zero', expected a number");
  refused(header + "0,0,,0,0,-1\n", "2: oz is '', expected a number");
  refused(header + "0,0,nan,0,0,-1\n", "2: oz is 'nan', expected a number");
  refused(header + "0,0,1e30,0,0,-1\n", "2: a ray's origin and direction must be finite");
  refused(header + "0,0,1e999,0,0,-1\n", "2: oz is '1e999', expected a number");
  refused(header + "0,0,0,0,0,0\n", "2: a ray's direction must not be zero");
  refused(header + std::string(5000, '1'), "2: a line of more than 4096 characters");
  check_refused(run_program(folder.path(), {"trace", "flat.ply", "none.csv"}), 2,
                "none.csv: there is no such file");
  check_refused(run_program(folder.path(), {"trace", "none.ply", "rays.csv"}), 2, "rays.csv:2:");
  write_text(folder / "rays.csv", header);
  CHECK(lines_of(run_program(folder.path(), {"trace", "flat.ply", "rays.csv"}).out).size() == 1);
  check_refused(run_program(folder.path(), {"trace", "none.ply", "rays.csv"}), 2, "none.ply");
  check_refused(run_program(folder.path(), {"trace", "flat.ply", "rays.csv", "--intersector", "x"}),
                2, "there are: embree");
  check_refused(run_program(folder.path(), {"mesh-info", "rays.csv"}), 2, "rays.csv");
}
