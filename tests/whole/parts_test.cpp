// A run in parts has the same content as a run of one part. It stays the same if the run is
// stopped, killed or shared by several processes.

#include <sys/mount.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <span>
#include <thread>
#include <vector>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/tiny_recipe.h"
#include "support/tiny_scene.h"
#include "support/tree.h"

#include <ensonify/engine/output/png.h>

using namespace ensonify::tests;
namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;
using namespace std::chrono_literals;

// Objects and their shadows, lost and repeated pings, a part that ends within a block.
const std::string scene_of_parts = tiny_scene + R"(
[[objects]]
shape = "box"
count = 12
length_m = 2
width_m = 1.5
tall_m = 1
[[objects]]
shape = "tyre"
count = 20
diameter_m = 2
[artefacts]
lost = 0.1
repeated = 0.1
[output]
npz = true
xtf = true
jsf = true
pings_per_file = 7
)";

std::string many_pings() { return changed(scene_of_parts, "pings = 9", "pings = 30"); }

Outcome run_in_parts(const fs::path& folder, const std::string& output,
                     std::vector<std::string> more = {},
                     const std::function<void(pid_t)>& meanwhile = {}) {
  std::vector<std::string> arguments{"run", "scene.toml", "-o", output, "--quiet"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_program(folder, arguments, {}, meanwhile);
}

void run_whole(const fs::path& folder, const std::string& output,
               std::vector<std::string> more = {}) {
  const Outcome outcome = run_in_parts(folder, output, std::move(more));
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
}

std::map<std::string, std::string> tree_of_whole_run(const fs::path& folder) {
  run_whole(folder, "expected", {"--threads", "1"});
  return tree_of(folder / "expected");
}

void check_killed_runs(int kills) {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", changed(many_pings(), "elevations = 128", "elevations = 4000"));
  const auto expected = tree_of_whole_run(folder.path());
  std::mt19937 random(7);
  int killed = 0, resumed = 0;
  for (int round = 0; killed < kills; ++round) {
    REQUIRE(round < 20 * kills);
    resumed += fs::exists(folder / "killed/part_0001");
    const Outcome outcome =
        run_in_parts(folder.path(), "killed", {"--threads", "2"}, [&](pid_t id) {
          // Every second time right after a part, so that there is something to continue.
          const auto parts = [&] {
            int count = 0;
            while (fs::exists(folder / ("killed/part_000" + std::to_string(count + 1)))) ++count;
            return count;
          };
          const auto ended = [&] {
            siginfo_t info{};
            return waitid(P_PID, static_cast<id_t>(id), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
                   info.si_pid == id;
          };
          for (const int before = parts(); round % 2 == 1 && parts() == before && !ended();)
            std::this_thread::sleep_for(2ms);
          std::this_thread::sleep_for((random() % (round % 2 == 1 ? 20 : 200)) * 1ms);
          kill(id, SIGKILL);
        });
    if (outcome.code == -SIGKILL) {
      ++killed;
    } else {  // finished: begin again
      REQUIRE(outcome.code == 0);
      CHECK(difference(tree_of(folder / "killed"), expected) == "");
      fs::remove_all(folder / "killed");
    }
  }
  CHECK(resumed > 0);
  run_whole(folder.path(), "killed");
  CHECK(difference(tree_of(folder / "killed"), expected) == "");
}

/// The pixels in polygons [column, row, ...].
long area_of(const Json& polygons) {
  long twice = 0;
  for (const Json& json : polygons) {
    const auto p = json.get<std::vector<long>>();
    long its = 0;
    for (std::size_t i = 0, n = p.size(); i < n; i += 2)
      its += p[i] * p[(i + 3) % n] - p[(i + 2) % n] * p[i + 1];
    twice += std::abs(its);
  }
  return twice / 2;
}

/// The samples of an XTF after its header, or of a JSF.
std::string recording(const std::map<std::string, std::string>& files, const std::string& name) {
  return files.at(name).substr(name.ends_with(".xtf") ? 1024 : 0);
}

}  // namespace

TEST_CASE("each leg of a lawn-mower has a part of its own, to the bytes of the run of one part") {
  const TemporaryFolder folder;
  const std::string legs = R"(kind = "lawn-mower"
legs = 3
leg_length_m = 8
leg_spacing_m = 4
ping_interval_s = 0.5
)";
  write_text(folder / "scene.toml", changed(changed(scene_of_parts, "pings = 9\n", legs),
                                            "pings_per_file = 7", "file_per_leg = true"));
  run_whole(folder.path(), "one", {"-D", "output.file_per_leg=false"});
  run_whole(folder.path(), "legs");
  const auto one = tree_of(folder / "one"), parts = tree_of(folder / "legs");
  const Json listed = Json::parse(parts.at("manifest.json")).at("parts");
  REQUIRE(listed.size() == 3);
  std::string joined;
  std::size_t next = 0;
  for (std::size_t leg = 0; leg < 3; ++leg) {
    const std::string number = "000" + std::to_string(leg + 1);
    joined += recording(parts, "part_" + number + "/left-right_" + number + ".xtf");
    CHECK(listed[leg].at("first_ping") == next);
    next += listed[leg].at("pings").get<std::size_t>();
    // 8 m and half a circle of 2 m, at 1 m per ping; no turn after the last leg.
    const auto pings = listed[leg].at("pings").get<double>();
    CHECK(pings == Approx(leg < 2 ? 8.0 + 6.3 : 9.0).margin(1.0));
  }
  CHECK(joined == recording(one, "left-right.xtf"));
  CHECK(parts.at("left-right.png") == one.at("left-right.png"));
  run_whole(folder.path(), "short", {"-D", "output.pings_per_file=5"});
  CHECK(Json::parse(tree_of(folder / "short").at("manifest.json")).at("parts").size() == 8);
  const Outcome line = run_in_parts(folder.path(), "line", {"-D", "track.kind=\"line\""});
  CHECK(line.code == 2);
  CHECK(line.err.find("'output.file_per_leg' needs legs") != std::string::npos);
}

TEST_CASE("an object that moves is where it is at each ping, in any part and on any thread") {
  const TemporaryFolder folder;
  const std::string moving = scene_of_parts + R"([[objects]]
shape = "box"
class = "vehicle"
length_m = 2
width_m = 2
tall_m = 1
height_m = 0.5
east_m = 7
path = [[-2, 2], [2, 2]]
speed_mps = 3
)";
  write_text(folder / "scene.toml", moving);
  // The rays that meet it are not compared with the fixed faces.
  run_whole(folder.path(), "verified", {"-D", "output.pings_per_file=0", "--verify", "3"});
  run_whole(folder.path(), "one", {"--threads", "1", "-D", "output.pings_per_file=0"});
  run_whole(folder.path(), "parts", {"--threads", "1"});
  run_whole(folder.path(), "threads", {"--threads", "2"});
  const auto one = tree_of(folder / "one"), parts = tree_of(folder / "parts");
  CHECK(difference(tree_of(folder / "threads"), parts) == "");
  CHECK(recording(parts, "part_0001/left-right_0001.xtf") +
            recording(parts, "part_0002/left-right_0002.xtf") ==
        recording(one, "left-right.xtf"));
  CHECK(parts.at("left-right.png") == one.at("left-right.png"));
  // Its place is that of its ping.
  bool listed = false;
  const Json targets = Json::parse(one.at("left-right_targets.json")).at("targets");
  for (const Json& target : targets) {
    if (target.at("class") != "vehicle") continue;
    listed = true;
    CHECK(target.at("table") == 2);
    CHECK(target.at("visible_fraction").is_null());
    CHECK(target.at("middle_m")[1].get<double>() > 0.0);  // has left its place
  }
  CHECK(listed);
}

TEST_CASE("a run in parts takes no more memory for more pings", "[slow]") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", R"(version = 1
[seafloor]
extent_east_m = 108
extent_north_m = 40
cell_m = 0.5
[track]
speed_mps = 0.05
[output]
exr = false
pings_per_file = 250
[display]
speed_correction = true
[sonar.sidescan]
preset = "edgetech-4125-400-900-low"
range_m = 50
bins = 1000
planes = 4
elevations = 64
)");
  // Of all processes so far; on one thread, because with more it depends on who waits for whom.
  const auto peak_kb = [&](const std::string& pings) {
    run_whole(folder.path(), pings, {"-D", "track.pings=" + pings, "--threads", "1"});
    rusage usage{};
    getrusage(RUSAGE_CHILDREN, &usage);
    return static_cast<double>(usage.ru_maxrss);
  };
  const double of_few_kb = peak_kb("1000");
  CHECK(peak_kb("6000") < 1.05 * of_few_kb);
}

TEST_CASE("the parts of a run put together are the run of one part") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", many_pings());
  run_whole(folder.path(), "one", {"-D", "output.pings_per_file=1000"});
  run_whole(folder.path(), "parts");
  const auto one = tree_of(folder / "one"), parts = tree_of(folder / "parts");
  const std::string name = "left-right";
  CHECK(parts.at(name + ".png") == one.at(name + ".png"));
  std::map<std::string, std::string> joined;
  for (const std::string number : {"0001", "0002", "0003", "0004", "0005"}) {
    const std::string its = "part_" + number + "/" + name + "_" + number;
    for (const std::string ending : {".xtf", ".jsf"})
      joined[ending] += recording(parts, its + ending);
    const std::string& table = parts.at(its + "_pings.csv");
    joined[".csv"] += joined[".csv"].empty() ? table : table.substr(table.find('\n') + 1);
    CHECK(parts.contains(its + ".exr"));
    CHECK(parts.contains(its + ".png"));
  }
  CHECK(parts.at("part_0002/left-right_0002.xtf").substr(100, 20) ==
        std::string("left-right_0002.xtf\0", 20));
  CHECK(joined[".xtf"] == recording(one, name + ".xtf"));
  CHECK(joined[".jsf"] == recording(one, name + ".jsf"));
  CHECK(joined[".csv"] == one.at(name + "_pings.csv"));

  const Json whole = Json::parse(one.at(name + "_targets.json"));
  Json together = Json::parse(parts.at(name + "_targets.json"));
  CHECK(together.at("picture") == whole.at("picture"));
  REQUIRE(together.at("targets").size() == whole.at("targets").size());
  int in_several = 0, with_holes = 0;
  for (std::size_t i = 0; i < whole.at("targets").size(); ++i) {
    const Json &a = whole["targets"][i], &b = together["targets"][i];
    CAPTURE(i, a.dump(), b.dump());
    for (const std::string key : {"instance", "class", "material", "side", "visible_fraction"})
      CHECK(a.at(key) == b.at(key));
    for (const std::string key : {"range_m", "ping"})
      CHECK(b.at(key).get<double>() == Approx(a.at(key).get<double>()));
    CHECK(b.at("aspect_deg").get<double>() ==
          Approx(a.at("aspect_deg").get<double>()).margin(1e-9));
    for (const std::string key : {"body", "shadow"}) {
      REQUIRE(a.at(key).is_null() == b.at(key).is_null());
      if (a.at(key).is_null()) continue;
      CHECK(a[key]["box"] == b[key]["box"]);
      CHECK(a[key]["area_px"] == b[key]["area_px"]);
      // What surrounds a hole in the whole picture may have none in each part.
      if (b[key].contains("rle"))
        CHECK(a[key].at("rle") == b[key]["rle"]);
      else
        CHECK(area_of(b[key]["polygons"]) == b[key]["area_px"].get<long>());
      in_several += b[key]["polygons"].size() > a[key]["polygons"].size();
      with_holes += b[key].contains("rle");
    }
    // The seabed near it is only that of its parts.
    CHECK(a.at("contrast_db").is_null() == b.at("contrast_db").is_null());
  }
  CHECK(in_several > 0);
  CHECK(with_holes > 0);

  const Json manifest = Json::parse(parts.at("manifest.json"));
  CHECK(manifest.at("counts") == Json::parse(one.at("manifest.json")).at("counts"));
  REQUIRE(manifest.at("parts").size() == 5);
  CHECK(manifest["parts"][4]["folder"] == "part_0005");
  CHECK(manifest["parts"][4]["first_ping"] == 28);
  CHECK(manifest["parts"][4]["pings"] == 2);
  // All other files are listed.
  CHECK(manifest.at("files").size() == parts.size() - 1);
  CHECK(!Json::parse(one.at("manifest.json")).contains("parts"));
  CHECK(!one.contains("run.json"));
}

TEST_CASE("smoothed pictures of parts are rows of the picture of the run of one part") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml",
             changed(changed(tiny_scene, "version = 1", "version = 1\nconditions = \"survey\""),
                     "pings = 9", "pings = 30") +
                 R"([sonar.beams]
range_m = 15
bins = 80
elevations = 128
array_length_m = 0.6
beams = 3
beam_spacing_m = 0.2
[artefacts]
lost = 0.1
[output]
exr = false
truth = true
)");
  // Smoothing of 4 pixels reaches beyond the next part.
  for (const std::vector<std::string>& display : std::vector<std::vector<std::string>>{
           {},
           {"-D", "display.smoothing_px=1.5", "-D", "output.png_bits=16"},
           {"-D", "display.smoothing_px=4", "-D", "display.slant_range_correction=true"},
           {"-D", "display.track_smoothing_px=0", "-D", "output.exr=true"}}) {
    CAPTURE(display);
    const auto files_of = [&](const std::string& output, const std::string& pings) {
      std::vector<std::string> more{"-D", "output.pings_per_file=" + pings, "--threads", "2"};
      more.insert(more.end(), display.begin(), display.end());
      fs::remove_all(folder / output);
      run_whole(folder.path(), output, more);
      return tree_of(folder / output);
    };
    const auto one = files_of("one", "30"), parts = files_of("parts", "7");
    for (const std::string name : {"left-right", "beams"}) {
      CAPTURE(name);
      CHECK(parts.at(name + ".png") == one.at(name + ".png"));
      const auto decoded = [](const std::string& png) {
        return ensonify::engine::decode_png(std::as_bytes(std::span(png)));
      };
      const std::size_t columns = decoded(one.at(name + ".png")).width;
      const auto whole_truth = decoded(one.at(name + "_truth.png"));
      const std::size_t beams = name == "beams" ? 3 : 1;
      for (std::size_t part = 0; part < 5; ++part) {
        const std::string number = "000" + std::to_string(part + 1);
        const auto truth =
            decoded(parts.at("part_" + number + "/" + name + "_" + number + "_truth.png"));
        const std::size_t end = std::min<std::size_t>(7 * part + 7, 30), above = (30 - end) * beams;
        const auto pixels = [&](const auto& picture, std::size_t row) {
          return std::span(picture.pixels).subspan(3 * row * picture.width, 3 * columns);
        };
        for (std::size_t row = 0; row < (end - 7 * part) * beams; ++row) {
          CAPTURE(part, row);
          CHECK(std::ranges::equal(pixels(truth, row), pixels(whole_truth, above + row)));
        }
      }
    }
  }
}

TEST_CASE("a wall across the track has the side and aspect of the whole run in any parts") {
  const TemporaryFolder folder;
  // Pings that see it on both sides, with a vehicle that turns to and fro.
  write_text(folder / "scene.toml", changed(tiny_scene, "pings = 9", "pings = 30\naltitude_m = 6") +
                                        R"([motion]
heading = { rms_deg = 3, period_s = 6 }
[[objects]]
shape = "box"
length_m = 14
width_m = 1
tall_m = 1
heading_deg = 60
)");
  const auto target = [&](const std::string& pings) {
    run_whole(folder.path(), "by" + pings, {"-D", "output.pings_per_file=" + pings});
    return Json::parse(read_text(folder / ("by" + pings) / "left-right_targets.json"))
        .at("targets")
        .at(0);
  };
  const Json whole = target("30");
  for (const std::string pings : {"8", "12", "16", "20"}) {
    const Json joined = target(pings);
    CAPTURE(pings, joined.dump(), whole.dump());
    CHECK(joined.at("side") == whole.at("side"));
    CHECK(joined.at("aspect_deg").get<double>() ==
          Approx(whole.at("aspect_deg").get<double>()).margin(1e-9));
  }
}

TEST_CASE("a run in parts needs at most the disk that it states") {
  const TemporaryFolder folder;
  const std::string scene = changed(many_pings(), "bins = 100", "bins = 2000");
  for (const std::string output : {"exr_compression = \"none\"\ntruth = true\n", "exr = false\n"}) {
    CAPTURE(output);
    write_text(folder / "scene.toml", scene + output);
    fs::remove_all(folder / "run");
    const Outcome outcome = run_program(folder.path(), {"run", "scene.toml", "-o", "run"});
    REQUIRE(outcome.code == 0);
    double bytes = 0.0;
    for (const auto& [name, content] : tree_of(folder / "run"))
      bytes += static_cast<double>(content.size());
    const std::string before = "need at most ";
    const std::size_t at = outcome.err.find(before);
    REQUIRE(at != std::string::npos);
    const double stated = 1e9 * std::stod(outcome.err.substr(at + before.size()));
    CHECK(bytes < stated);
    CHECK(stated < (output.starts_with("exr_") ? 2.0 : 8.0) * bytes);
  }
}

TEST_CASE("a run in parts is the same on any number of threads, and when it is run again") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", many_pings());
  const auto expected = tree_of_whole_run(folder.path());
  for (const std::string threads : {"2", "4"}) {
    run_whole(folder.path(), "on" + threads, {"--threads", threads});
    CHECK(difference(tree_of(folder / ("on" + threads)), expected) == "");
  }
  run_whole(folder.path(), "expected");
  CHECK(difference(tree_of(folder / "expected"), expected) == "");
}

TEST_CASE("shares of a run's parts, merged, are the run") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", many_pings());
  const auto expected = tree_of_whole_run(folder.path());
  for (const int shares : {1, 3, 7}) {
    const std::string output = "by" + std::to_string(shares);
    for (int share = shares - 1; share >= 0; --share) {
      run_whole(folder.path(), output,
                {"--part", std::to_string(share) + "/" + std::to_string(shares)});
      if (shares > 1) CHECK(!fs::exists(folder / output / "manifest.json"));
    }
    const Outcome merged = run_program(folder.path(), {"merge", output, "--quiet"});
    INFO(merged.err);
    CHECK(merged.code == 0);
    CHECK(difference(tree_of(folder / output), expected) == "");
  }
  for (const char* share : {"3", "4/4", "-1/4", "a/b", "0/0"})
    CHECK(run_in_parts(folder.path(), "other", {"--part=" + std::string(share)}).code == 2);
  // With more shares than parts some have none: those end before there is a seafloor.
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{},
        {"-D", "output.pings_per_file=0", "-D", "output.file_per_leg=true", "-D",
         "track.kind=lawn-mower", "-D", "track.legs=2", "-D", "track.leg_length_m=8", "-D",
         "track.leg_spacing_m=5", "-D", "track.turn_radius_m=2", "-D",
         "track.ping_interval_s=0.5"}}) {
    std::vector<std::string> arguments{"run", "scene.toml", "-o", "none",  "--part",
                                       "0/7", "--verify",   "2",  "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome none = run_program(folder.path(), arguments);
    INFO(none.err);
    CHECK(none.code == 0);
    const std::string parts = more.empty() ? "5" : "2";
    CHECK(none.err.find("share 0 of 7 has no parts, because the run has " + parts) !=
          std::string::npos);
    CHECK(Json::parse(none.out).at("counts").at("pings") == 0);
    CHECK(!fs::exists(folder / "none"));
  }
  const Outcome one =
      run_in_parts(folder.path(), "other", {"--part=0/2", "-D", "output.pings_per_file=100"});
  CHECK(one.code == 2);
  CHECK(one.err.find("set output.pings_per_file") != std::string::npos);
  CHECK(!fs::exists(folder / "other"));
}

TEST_CASE("merge names missing and damaged parts of a run, and writes nothing") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", many_pings());
  run_whole(folder.path(), "run", {"--part", "0/2"});
  const auto before = tree_of(folder / "run");
  const Outcome missing = run_program(folder.path(), {"merge", "run", "--quiet"});
  CHECK(missing.code == 1);
  CHECK(missing.err.find("parts 3 to 5 are missing") != std::string::npos);
  CHECK(difference(tree_of(folder / "run"), before) == "");

  run_whole(folder.path(), "run", {"--part", "1/2"});
  const fs::path damaged = folder / "run/part_0002/left-right_0002.exr";
  std::string content = read_text(damaged);
  content[content.size() / 2] ^= 1;
  write_text(damaged, content);
  const Outcome outcome = run_program(folder.path(), {"merge", "run", "--quiet"});
  CHECK(outcome.code == 1);
  CHECK(outcome.err.find("left-right_0002.exr: its content has changed") != std::string::npos);
  CHECK(!fs::exists(folder / "run/manifest.json"));
}

TEST_CASE("a run's folder with a damaged plan or record is a wrong input of run and merge") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", many_pings());
  run_whole(folder.path(), "run");
  const auto refused = [&](const Outcome& outcome, const std::string& message) {
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.err.find(message) != std::string::npos);
  };
  write_text(folder / "run/part_0002/part.json", "{}");
  refused(run_program(folder.path(), {"merge", "run", "--quiet"}), "not the record of a part");
  for (const std::string plan : {"{", "{}", R"({"seed": -1, "scene": "", "intersector": ""})"}) {
    write_text(folder / "run/run.json", plan);
    refused(run_program(folder.path(), {"merge", "run", "--quiet"}), "run/run.json: ");
    refused(run_in_parts(folder.path(), "run"), "run/run.json: ");
  }
}

TEST_CASE("a part of another run is noticed by merge, and made again by run") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", many_pings());
  run_whole(folder.path(), "run");
  REQUIRE(run_in_parts(folder.path(), "other", {"--seed", "9"}).code == 0);
  const auto expected = tree_of(folder / "run");
  fs::remove_all(folder / "run/part_0002");
  fs::copy(folder / "other/part_0002", folder / "run/part_0002", fs::copy_options::recursive);
  const Outcome merged = run_program(folder.path(), {"merge", "run"});
  CHECK(merged.code == 1);
  CHECK(merged.err.find("part_0002: it is a part of another run") != std::string::npos);
  run_whole(folder.path(), "run");
  CHECK(difference(tree_of(folder / "run"), expected) == "");
}

TEST_CASE("parts that lack files, or whose files or records are damaged, are made again") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", many_pings());
  const auto expected = tree_of_whole_run(folder.path());
  run_whole(folder.path(), "run", {"--part", "0/1"});
  fs::remove(folder / "run/part_0001/left-right_0001.exr");
  fs::resize_file(folder / "run/part_0002/left-right_0002.exr", 100);
  fs::resize_file(folder / "run/part_0003/part.json", 20);
  fs::copy_file(folder / "run/part_0001/part.json", folder / "run/part_0004/part.json",
                fs::copy_options::overwrite_existing);
  fs::remove_all(folder / "run/part_0005");
  fs::create_directory(folder / "run/part_0005");
  const Outcome outcome =
      run_program(folder.path(), {"run", "scene.toml", "-o", "run", "--part", "0/1", "--json"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  CHECK(difference(tree_of(folder / "run"), expected) == "");
}

TEST_CASE("what is not of the run is never removed from the places of its parts") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", many_pings());
  const auto check_refused = [&](const std::string& output, std::vector<std::string> more,
                                 const std::string& named) {
    const auto before = tree_of(folder / output);
    const Outcome outcome = run_in_parts(folder.path(), output, std::move(more));
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.err.find(named + ": is not of ") != std::string::npos);
    CHECK(difference(tree_of(folder / output), before) == "");
  };
  fs::create_directories(folder / "mine/part_0001");
  write_text(folder / "mine/part_0001/thesis.txt", "precious");
  check_refused("mine", {}, "mine/part_0001");
  fs::create_directory(folder / "picture");
  write_text(folder / "picture/left-right.png", "precious");
  check_refused("picture", {}, "picture/left-right.png");

  run_whole(folder.path(), "run");
  fs::remove(folder / "run/part_0002/part.json");
  write_text(folder / "run/part_0002/thesis.txt", "precious");
  check_refused("run", {}, "run/part_0002/thesis.txt");
  fs::remove_all(folder / "run/part_0002");
  write_text(folder / "run/part_0002", "no folder");
  check_refused("run", {}, "run/part_0002");
  // If the plan is missing, whole parts of the same run are used. Parts of another run are not.
  fs::remove(folder / "run/part_0002");
  run_whole(folder.path(), "run");
  for (const char* top : {"run.json", "manifest.json", "left-right.png", "left-right_targets.json"})
    fs::remove(folder / "run" / top);
  check_refused("run", {"-D", "seed=5"}, "run/part_0001");
  run_whole(folder.path(), "run");
}

TEST_CASE("a run in parts that is killed several times becomes the same, without leftovers") {
  check_killed_runs(6);
}

TEST_CASE("a run in parts that is killed 60 times becomes the same, without leftovers", "[.soak]") {
  check_killed_runs(60);
}

TEST_CASE("SIGTERM ends a run in parts with 75, and the same command continues") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", changed(many_pings(), "elevations = 128", "elevations = 6000"));
  const auto expected = tree_of_whole_run(folder.path());
  const Outcome outcome =
      run_in_parts(folder.path(), "run", {"--threads", "1"}, [&](pid_t process) {
        while (!fs::exists(folder / "run/part_0001"))
          std::this_thread::sleep_for(std::chrono::milliseconds(2));
        kill(process, SIGTERM);
      });
  INFO(outcome.err);
  CHECK(outcome.code == 75);
  CHECK(outcome.err.find("the same command makes the others") != std::string::npos);
  for (const auto& entry : fs::directory_iterator(folder / "run"))
    CHECK(!entry.path().filename().string().starts_with("."));
  run_whole(folder.path(), "run");
  CHECK(difference(tree_of(folder / "run"), expected) == "");
}

TEST_CASE("two processes in one folder make one run in parts together") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", many_pings());
  const auto expected = tree_of_whole_run(folder.path());
  for (int round = 0; round < 3; ++round) {
    const std::string output = "both" + std::to_string(round);
    Outcome other;
    std::thread second([&] { other = run_in_parts(folder.path(), output); });
    const Outcome outcome = run_in_parts(folder.path(), output);
    second.join();
    INFO(outcome.err << other.err);
    CHECK(outcome.code == 0);
    CHECK(other.code == 0);
    CHECK(difference(tree_of(folder / output), expected) == "");
  }
}

TEST_CASE("a folder with parts of another run is refused with what changed") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", many_pings());
  run_whole(folder.path(), "run", {"--part", "0/2"});
  const auto before = tree_of(folder / "run");
  const Outcome outcome =
      run_in_parts(folder.path(), "run", {"-D", "sonar.left-right.range_m=14", "--verify", "2"});
  CHECK(outcome.code == 2);
  CHECK(outcome.err.find("sonar.left-right.range_m was 15 and is 14") != std::string::npos);
  CHECK(outcome.err.find("--verify was 0 and is 2") != std::string::npos);
  CHECK(outcome.err.find("choose another folder with -o") != std::string::npos);
  write_text(folder / "cast.csv", "depth_m,soundspeed_mps\n0,1500\n50,1490\n");
  const std::vector<std::string> cast{"--part", "0/2", "-D", "sea.profile=cast.csv"};
  run_whole(folder.path(), "bent", cast);
  write_text(folder / "cast.csv", "depth_m,soundspeed_mps\n0,1500\n50,1480\n");
  const Outcome other_cast = run_in_parts(folder.path(), "bent", cast);
  CHECK(other_cast.code == 2);
  CHECK(other_cast.err.find("the file of sea.profile has another content") != std::string::npos);
  const Outcome one = run_in_parts(folder.path(), "run", {"-D", "output.pings_per_file=100"});
  CHECK(one.code == 2);
  CHECK(difference(tree_of(folder / "run"), before) == "");

  run_whole(folder.path(), "whole", {"-D", "output.pings_per_file=100"});
  const auto whole = tree_of(folder / "whole");
  CHECK(run_in_parts(folder.path(), "whole").code == 2);
  CHECK(difference(tree_of(folder / "whole"), whole) == "");
}

TEST_CASE("a disk that becomes full leaves whole parts, and the same command continues") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", many_pings());
  const auto expected = tree_of_whole_run(folder.path());
  std::size_t part_bytes = 0;
  for (const auto& [name, content] : expected)
    if (name.starts_with("part_0001")) part_bytes += content.size();
  fs::create_directory(folder / "small");
  const std::string size = "size=" + std::to_string(2 * part_bytes / 1024 + 60) + "k";
  if (mount("tmpfs", (folder / "small").c_str(), "tmpfs", 0, size.c_str()) != 0) {
    WARN("no right to mount a small file system: not tried");
    return;
  }
  const Outcome outcome = run_in_parts(folder.path(), "small/run", {"--threads", "1"});
  const auto left = tree_of(folder / "small/run");
  fs::copy(folder / "small/run", folder / "run", fs::copy_options::recursive);
  umount((folder / "small").c_str());
  INFO(outcome.err);
  CHECK(outcome.code == 1);
  CHECK(outcome.err.find("No space left on device") != std::string::npos);
  CHECK(outcome.err.find("parts are finished") != std::string::npos);
  CHECK(left.contains("part_0001/part.json"));
  for (const auto& [name, content] : left)
    CHECK((name == "left-right.png" || expected.at(name) == content));
  run_whole(folder.path(), "run");
  CHECK(difference(tree_of(folder / "run"), expected) == "");
}
