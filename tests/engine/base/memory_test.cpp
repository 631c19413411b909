#include <ensonify/engine/base/memory.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "support/catch.h"
#include "support/little_memory.h"
#include "support/mesh_files.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/run.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/engine/sonar/instrument/presets.h>

using namespace ensonify;
using namespace ensonify::engine;
using tests::TemporaryFolder;

namespace {

namespace fs = std::filesystem;

constexpr double gb = 1e9;

double read_bytes() {
  std::ifstream in("/proc/self/io");
  double bytes = 0.0;
  std::string name;
  in >> name >> bytes;
  REQUIRE(name == "rchar:");
  return bytes;
}

/// A text grid with a correct header: the file has the right length and contains only holes.
void write_huge_grid(const fs::path& file, int columns, int rows) {
  std::ofstream(file) << "ncols " << columns << "\nnrows " << rows
                      << "\nxllcorner 500000\nyllcorner 4000000\ncellsize 0.5\n"
                         "NODATA_value -9999\n-1.5 ";
  fs::resize_file(file,
                  2 * static_cast<std::uintmax_t>(columns) * static_cast<std::uintmax_t>(rows));
}

Scene survey_scene(const fs::path& file) {
  Scene scene;
  scene.seafloor.kind = SeafloorKind::survey;
  scene.seafloor.survey = {file.filename(), file};
  return scene;
}

Scene fractal_scene(double cell_m) {
  Scene scene;
  scene.seafloor.extent_east_m = 100.0;
  scene.seafloor.extent_north_m = 80.0;
  scene.seafloor.cell_m = cell_m;
  scene.track.pings = 4;
  scene.sonars.front().range_m = 30.0;
  return scene;
}

}  // namespace

TEST_CASE(
    "a refusal names what does not fit, how much memory it needs, the limit and what to change") {
  const MemoryLimit limit{5.0 * gb};
  CHECK_NOTHROW(limit.require(0.0, "pictures", "fewer"));
  CHECK_NOTHROW(limit.require(1.0 * gb, "pictures", "fewer"));
  CHECK_THROWS_WITH(limit.require(7.5 * gb, "the pictures of 9 pings", "use fewer pings"),
                    Catch::Contains("the pictures of 9 pings need about 7.5 GB of memory, but "
                                    "--memory allows 5.0 GB, of which ") &&
                        Catch::Contains(" are used; use fewer pings"));
  CHECK_THROWS_WITH(MemoryLimit{}.require(1e18, "pictures", "use fewer"),
                    Catch::Contains(" are available (--memory sets another limit); use fewer"));
}

TEST_CASE("ripples much longer than the seafloor are refused by the name of their key") {
  Scene scene = fractal_scene(0.2);
  scene.seafloor.ripples.rms_height_m = 0.1;
  scene.seafloor.ripples.wavelength_m = 1000.0;
  CHECK_THROWS_WITH(prepare_seafloor(scene, {.memory = {4.0 * gb}}),
                    Catch::Contains("ripples of 1000 m in cells of 0.2 m") &&
                        Catch::Contains("make seafloor.ripples.wavelength_m shorter"));
}

#ifdef ENSONIFY_CAN_LIMIT_MEMORY
TEST_CASE("the available memory respects the limit of the address space") {
  const double before = available_memory_bytes();
  CHECK(before > 0.0);
  const tests::LittleMemory little(std::size_t{1} << 28);
  const double available = available_memory_bytes();
  CHECK(available <= 0x1p28);
  CHECK(available >= std::min(0.5 * before, 0x1p27));
}

TEST_CASE("a seafloor that does not fit in the address space is refused before it is made") {
  const tests::LittleMemory little(std::size_t{1} << 28);
  CHECK_THROWS_WITH(prepare_seafloor(fractal_scene(0.02), {}),
                    Catch::Contains("a seafloor of 5001 x 4001 points and what is built over it "
                                    "need about") &&
                        Catch::Contains("seafloor.cell_m larger"));
}

TEST_CASE("if memory runs out in spite of the estimate, the message says what was being made") {
  const tests::LittleMemory little(std::size_t{1} << 27);
  // The limit is above the machine's memory, so the estimate is accepted.
  CHECK_THROWS_WITH(prepare_seafloor(fractal_scene(0.02), {.memory = {1e15}}),
                    Catch::Contains("out of memory while making the seafloor"));
}
#endif

TEST_CASE("a survey grid that does not fit is refused by its header, and is not read") {
  const TemporaryFolder folder;
  // Larger ones are made in tiles.
  write_huge_grid(folder / "grid.asc", 8000, 8000);
  const Scene scene = survey_scene(folder / "grid.asc");
  const double before = read_bytes();
  CHECK_THROWS_WITH(prepare_seafloor(scene, {.memory = {0.2 * gb}}),
                    Catch::Contains("a seafloor of 8000 x 8000 points") &&
                        Catch::Contains("of memory, but --memory allows 200 MB") &&
                        Catch::Contains("gdal_translate -projwin"));
  CHECK(read_bytes() - before < 1e8);
}

TEST_CASE("a survey grid that is refused for its size is not hashed for the cache") {
  const TemporaryFolder folder;
  write_huge_grid(folder / "grid.asc", 60000, 50000);
  Scene scene = survey_scene(folder / "grid.asc");
  for (const char* surface : {"auto", "refined", "static"}) {
    scene.run.surface = surface;
    const double before = read_bytes();
    CHECK_THROWS_WITH(prepare_seafloor(scene, {.cache = folder / "cache"}),
                      Catch::Contains("has 60000 x 50000 cells, more than 2^30"));
    CHECK(read_bytes() - before < 1e8);
  }
}

TEST_CASE("images that do not fit are refused before the seafloor is made, and leave nothing") {
  const TemporaryFolder folder;
  Scene scene = fractal_scene(0.5);
  scene.sonars.front().bins = 4000;
  scene.track.pings = 100000;
  scene.output.pings_per_file = 100000;
  const double bytes = image_bytes(scene.sonars, 100000);
  CHECK(bytes == 64.0 * 2 * 4000 * 1e5);  // 16 layers of 4 bytes
  bool began = false;
  const auto stages = [&](std::string_view, std::size_t, std::size_t) { return began = true; };
  CHECK_THROWS_WITH(
      run(scene, folder / "run", {.progress = stages, .memory = {4.0 * gb}}),
      Catch::Contains("the images of 100000 pings need about 51.2 GB of memory, but --memory "
                      "allows 4.0 GB") &&
          Catch::Contains("use fewer pings"));
  CHECK(!began);
  CHECK(!fs::exists(folder / "run"));

  // In parts the images of a few parts are enough.
  scene.output.pings_per_file = 0;
  const auto stop = [&](std::string_view, std::size_t, std::size_t) { return false; };
  CHECK_THROWS_AS(run(scene, folder / "run", {.progress = stop, .memory = {4.0 * gb}}), Stopped);
  CHECK(!fs::exists(folder / "run"));
}

TEST_CASE("the images that are in memory include the neighbours of parts that are written") {
  const TemporaryFolder folder;
  Scene scene = fractal_scene(0.5);
  scene.sonars.front().bins = 100;
  scene.track.pings = 100;
  scene.output.pings_per_file = 10;
  const auto memory_bytes = [&](int beams, double track_smoothing_px) {
    scene.sonars.front().beams = beams;
    scene.display.track_smoothing_px = track_smoothing_px;
    double bytes = 0.0;
    const auto stop = [&](const RunSize& size) {
      bytes = size.memory_bytes;
      throw Stopped("known");
    };
    CHECK_THROWS_AS(run(scene, folder / "run", {.threads = 2, .on_parts = stop}), Stopped);
    fs::remove_all(folder / "run");
    return bytes / image_bytes(scene.sonars, 1);
  };
  CHECK(memory_bytes(1, 0.0) == 30.0);
  // Two parts have 60 rows on each side.
  CHECK(memory_bytes(1, 20.0) == 30.0 + 2 * 2 * 60);
  CHECK(memory_bytes(7, 20.0) == 30.0 + 2 * 2 * 9);
}

TEST_CASE("an object that a session adds is refused if it does not fit") {
  Scene scene = fractal_scene(0.5);
  scene.run.surface = "footprint";
  Simulator simulator(scene, {.memory = {2.0 * gb}});
  refine::TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.faces.assign(5'000'000, {0, 1, 2});
  const Pose pose{.position = {0.0, 0.0, -10.0}};
  CHECK_THROWS_WITH(simulator.add({.mesh = mesh, .material = "rock", .class_name = "reef"}, pose),
                    Catch::Contains("Simulator: 'reef': the 5 million faces") &&
                        Catch::Contains("use a coarser mesh"));
}

TEST_CASE("the rays of many sonars on several threads are counted before the seafloor is made") {
  const TemporaryFolder folder;
  Scene scene = fractal_scene(0.5);
  scene.run.intersector = "fan_scan";
  scene.track.pings = 4 * scene.run.block_pings;
  scene.sonars.resize(300, scene.sonars.front());
  for (std::size_t i = 0; i < scene.sonars.size(); ++i)
    scene.sonars[i].name = "sonar" + std::to_string(i);
  scene.sonars.front().bins = 100;
  bool began = false;
  const auto stages = [&](std::string_view, std::size_t, std::size_t) { return !(began = true); };
  const auto try_run = [&](int threads, double limit) {
    run(scene, folder / "run", {.threads = threads, .progress = stages, .memory = {limit}});
  };
  const double bytes = ray_bytes(scene.sonars, "fan_scan");
  CHECK(bytes == 130.0 * 300 * 2 * 8 * scene.sonars.front().elevations);
  const double limit = 3.0 * bytes + image_bytes(scene.sonars, 4 * 64);
  CHECK_THROWS_WITH(try_run(4, limit),
                    Catch::Contains("rays of a ping, for 4 threads, and the images of") &&
                        Catch::Contains("fewer threads, or run the sonars in several scenes"));
  CHECK(!began);
  CHECK_THROWS_AS(try_run(1, limit), Stopped);
}

TEST_CASE("the bins of an imaging sonar's beams are counted, and named") {
  Scene scene = fractal_scene(0.5);
  scene.sonars = {usual_sonar(SonarKind::imaging)};
  Sonar& sonar = scene.sonars.front();
  const double few = ray_bytes(scene.sonars, "fan_scan");
  sonar.beams = 1024;
  sonar.bins = 65536;
  const double many = ray_bytes(scene.sonars, "fan_scan");
  CHECK(many > few + 100.0 * 1024 * 65536);
  CHECK_THROWS_WITH(Simulator(scene, {.threads = 1, .memory = {0.5 * many}}),
                    Catch::Contains("rays of a ping and the bins of its beams, for 1 thread,") &&
                        Catch::Contains("use fewer elevations, planes, beams or bins"));
}

TEST_CASE("a session counts the rays of its own thread, and a track those of all that ping it") {
  Scene scene = fractal_scene(0.5);
  scene.run.intersector = "fan_scan";
  scene.track.pings = 4 * scene.run.block_pings;
  scene.sonars.front().bins = 100;
  scene.sonars.front().planes = 64;
  scene.sonars.front().elevations = 50000;
  const double bytes = ray_bytes(scene.sonars, "fan_scan");
  const MemoryLimit limit{2.0 * bytes};
  Simulator session(scene, {.threads = 64, .memory = limit});
  const auto stop = [](std::span<const Waterfall>, std::size_t, std::size_t) {
    throw Stopped("stopped");
  };
  CHECK_THROWS_WITH(ping_all(scene, session, 4, stop, limit),
                    Catch::Contains("rays of a ping, for 4 threads, and the images of 256 pings,"));
  CHECK_THROWS_AS(ping_all(scene, session, 1, stop, limit), Stopped);
  Sonar more = scene.sonars.front();
  more.planes = 128;
  CHECK_THROWS_WITH(session.set_sonar(0, more), Catch::Contains("rays of a ping, for 1 thread,"));
  CHECK_THROWS_AS(Simulator(scene, {.threads = 1, .memory = {0.5 * bytes}}), MemoryError);
}
