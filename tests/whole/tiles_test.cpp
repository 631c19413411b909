// A bed in tiles, by the program: killed, shared by two processes, damaged on the disk, and long.

#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <ensonify/refine/height_tiles.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/little_memory.h"
#include "support/program.h"
#include "support/tree.h"

using namespace ensonify::tests;
namespace fs = std::filesystem;

namespace {

using namespace std::chrono_literals;

/// A strip of 12,000 x 60 cells, which no single transform holds, with layers.
std::string strip_scene() {
  return R"(version = 1
[seafloor]
extent_east_m = 1200
extent_north_m = 6
cell_m = 0.1
[seafloor.fractal]
height_at_1m_m = 0.03
[[seafloor.patches]]
material = "sandy gravel"
share = 0.4
patch_m = 8
[[seafloor.pits]]
per_hectare = 100
diameter_m = 1.5
[track]
heading_deg = 90
pings = 300
speed_mps = 2
ping_interval_s = 1
[sonar.left-right]
range_m = 15
bins = 100
elevations = 256
[output]
exr = false
)";
}

/// The program with the cache `cache` of the folder.
class Strip {
 public:
  explicit Strip(const std::string& surface) {
    write_text(folder_ / "scene.toml", strip_scene() + "[run]\nsurface = \"" + surface + "\"\n");
  }

  Outcome run(const std::string& cache, const std::string& output,
              const std::function<void(pid_t)>& meanwhile = {}) const {
    return call({"run", "scene.toml", "-o", output, "--quiet"}, cache, meanwhile);
  }
  Outcome analyse(const std::string& cache,
                  const std::function<void(pid_t)>& meanwhile = {}) const {
    return call({"analyse", "scene.toml", "--quiet"}, cache, meanwhile);
  }
  fs::path tiles(const std::string& cache) const {
    for (const auto& entry : fs::directory_iterator(folder_ / cache))
      if (entry.path().extension() == ".tiles") return entry.path();
    return {};
  }
  /// The files of the clusters over the tiles, for `refined`, in the order of their names.
  std::vector<fs::path> clusters(const std::string& cache) const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / cache))
      if (entry.path().extension() == ".mesh") files.push_back(entry.path());
    std::ranges::sort(files);
    return files;
  }
  /// The bytes of the tiles' file and of all clusters'.
  std::string content(const std::string& cache) const {
    std::string all = read_text(tiles(cache));
    for (const fs::path& file : clusters(cache)) all += file.filename().string() + read_text(file);
    return all;
  }
  fs::path operator/(const std::string& name) const { return folder_ / name; }

 private:
  Outcome call(std::vector<std::string> arguments, const std::string& cache,
               const std::function<void(pid_t)>& meanwhile) const {
    arguments.insert(arguments.end(), {"--threads", "2", "--cache", (folder_ / cache).string()});
    return run_program(folder_.path(), arguments, {}, meanwhile);
  }
  TemporaryFolder folder_;
};

bool has_ended(pid_t process) {
  siginfo_t info{};
  return waitid(P_PID, static_cast<id_t>(process), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid == process;
}

/// Kills a command until that has happened so often: every second time once it has a file of tiles.
void kill_often(int kills, const Strip& strip, const std::string& cache,
                const std::function<Outcome(const std::function<void(pid_t)>&)>& command) {
  std::mt19937 random(3);
  const auto has_tiles = [&] { return fs::exists(strip / cache) && !strip.tiles(cache).empty(); };
  int killed = 0;
  for (int round = 0; killed < kills; ++round) {
    REQUIRE(round < 20 * kills);
    const Outcome outcome = command([&](pid_t id) {
      while (round % 2 == 1 && !has_tiles() && !has_ended(id)) std::this_thread::sleep_for(2ms);
      std::this_thread::sleep_for(random() % 800 * 1ms);
      kill(id, SIGKILL);
    });
    if (outcome.code == -SIGKILL) {
      ++killed;
    } else {  // finished: begin again
      REQUIRE(outcome.code == 0);
      fs::remove_all(strip / cache);
    }
  }
}

void check_tiles(int kills, const std::string& surface) {
  const Strip strip(surface);
  CAPTURE(surface);
  REQUIRE(strip.run("expected", "expected-run").code == 0);
  const auto expected = tree_of(strip / "expected-run");
  const std::string of_run = strip.content("expected");
  REQUIRE(strip.analyse("expected").code == 0);
  const std::string whole = strip.content("expected");
  REQUIRE(whole != of_run);  // the track is shorter than the bed
  REQUIRE(strip.clusters("expected").empty() == (surface == "footprint"));

  const auto run = [&](const auto& meanwhile) { return strip.run("lazy", "lazy-run", meanwhile); };
  kill_often(kills, strip, "lazy", run);
  REQUIRE(run(std::function<void(pid_t)>()).code == 0);
  CHECK(difference(tree_of(strip / "lazy-run"), expected) == "");
  CHECK(strip.content("lazy") == of_run);

  kill_often(kills, strip, "all",
             [&](const auto& meanwhile) { return strip.analyse("all", meanwhile); });
  REQUIRE(strip.analyse("all").code == 0);
  CHECK(strip.content("all") == whole);

  // Two at once, from nothing.
  Outcome other;
  std::thread second([&] { other = strip.run("shared", "second-run"); });
  const Outcome first = strip.run("shared", "first-run");
  second.join();
  CHECK(first.code == 0);
  CHECK(other.code == 0);
  for (const char* output : {"first-run", "second-run"})
    CHECK(difference(tree_of(strip / output), expected) == "");
  CHECK(strip.content("shared") == of_run);

  // A byte in every tile and its kinds, and two of the table, which begins after 12 + 1 pages; and
  // bytes of every cluster.
  const auto damage = [](const fs::path& file, std::size_t first_byte) {
    std::string damaged = read_text(file);
    for (std::size_t place = first_byte; place < damaged.size(); place += 4099) damaged[place] ^= 8;
    write_text(file, damaged);
  };
  damage(strip.tiles("all"), 53300);
  for (const fs::path& file : strip.clusters("all")) damage(file, 5000);
  REQUIRE(strip.run("all", "damaged-run").code == 0);
  CHECK(difference(tree_of(strip / "damaged-run"), expected) == "");
  REQUIRE(strip.analyse("all").code == 0);
  CHECK(strip.content("all") == whole);
}

}  // namespace

TEST_CASE("Tiles survive kills and damage on the disk and are shared by two runs") {
  check_tiles(1, GENERATE("footprint", "refined"));
}

TEST_CASE("Tiles survive 40 kills of a run and of an analysis", "[.soak]") {
  check_tiles(40, GENERATE("footprint", "refined"));
}

#ifdef ENSONIFY_CAN_LIMIT_MEMORY  // not under sanitizers, whose own memory would count
TEST_CASE("A track of 10 km over a bed in tiles needs no more memory at its end", "[.soak]") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", R"(version = 1
[seafloor]
extent_east_m = 10000
extent_north_m = 200
cell_m = 0.25
[seafloor.fractal]
height_at_1m_m = 0.03
[track]
heading_deg = 90
pings = 5000
speed_mps = 2
ping_interval_s = 1
[sonar.left-right]
range_m = 40
bins = 100
elevations = 128
[output]
exr = false
pings_per_file = 500
)");
  std::vector<double> resident_mb;
  const Outcome outcome =
      run_program(folder.path(), {"run", "scene.toml", "-o", "out", "--quiet", "--threads", "2"},
                  {}, [&](pid_t process) {
                    resident_mb = memory_mb(process, "RssAnon:");  // without the mapped file
                  });
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  REQUIRE(resident_mb.size() > 40);
  const std::array<double, 4> largest_mb = largest_of_quarters(resident_mb);
  const double in_third = largest_mb[2], in_last = largest_mb[3];
  CAPTURE(in_third, in_last);
  CHECK(in_last < in_third + 16.0);  // measured: 170 and 175
  CHECK(in_last < 300.0);
}
#endif

TEST_CASE("mesh-info says where in the world a file of tiles lies") {
  const TemporaryFolder folder;
  {
    ensonify::refine::HeightTiles tiles(
        {-1.0f, 0.0f, 1.0f}, {-4.0f, 4.0f}, {500000.5, 6000000.0, 2.0},
        [](ensonify::refine::HeightTiles::Shape& shape) { shape.mean_height_m = -10.0; },
        [](int, int, int, int, std::span<double> z_m, std::span<std::uint8_t>) {
          std::ranges::fill(z_m, -10.0);
        },
        folder / "bed.tiles", "key");
    tiles.require(0);
  }
  CHECK(run_program(folder.path(), {"mesh-info", "bed.tiles"}).out ==
        "columns 3\nrows 2\ntriangles_without_holes 4\nx_min 499999.5\nx_max 500001.5\n"
        "y_min 5999996\ny_max 6000004\ntiles 1\ntiles_made 1\nz_min_of_made -8\n"
        "z_max_of_made -8\nmean_height_m -8\nmade_from key\n");
}

TEST_CASE("stream takes a bed in tiles, and commands that need all of a bed say what to do") {
  const TemporaryFolder folder;
  write_text(folder / "scene.toml", strip_scene());
  write_text(folder / "pose", "{\"x_m\": 0, \"y_m\": 0, \"z_m\": -12}\n");
  const Outcome streamed =
      run_program(folder.path(), {"stream", "scene.toml", "--quiet"}, {}, {}, {}, folder / "pose");
  CHECK(streamed.code == 0);
  CHECK_THAT(streamed.out, Catch::Contains("\"ping\":0"));
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"view", "scene.toml", "-o", "v.png"},
        {"check", "scene.toml"},
        {"seafloor", "scene.toml", "-o", "bed.ply"},
        {"seafloor", "scene.toml", "-o", "bed.npy"}}) {
    const Outcome outcome = run_program(folder.path(), command);
    CAPTURE(command[0], outcome.err);
    CHECK(outcome.code == 2);
    CHECK_THAT(outcome.err, Catch::Contains("too large to be made at once") &&
                                Catch::Contains("make seafloor.cell_m larger"));
    CHECK_THAT(outcome.err, !Catch::Contains("--surface"));
  }
}
