// The bytes of six scenes against hashes that are written down in golden_hashes.txt, by layer. All
// other tests compare a run with another run of the same program; this one finds changes from
// version to version.
//
// A hash that changed is a change for everyone who keeps datasets: mend the cause, or, if the new
// bytes are the right ones, copy the file that the failure names to golden_hashes.txt and say in
// the commit and in CHANGELOG.md what changed and why.
//
// The seafloors have no spectral relief, because another build of FFTW may choose other code. The C
// library chooses its own, too, so the test needs a machine with fused multiply-adds.

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/layered_sea.h"
#include "support/paths.h"
#include "support/targets.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/pings_csv.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/ping_all.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

// The seabed and the vehicle of all scenes: pits and boulders, a vehicle that moves.
constexpr std::string_view common = R"(version = 1
seed = 7
[seafloor]
extent_east_m = 60
extent_north_m = 30
cell_m = 0.25
depth_m = 15
fractal.height_at_1m_m = 0
[[seafloor.pits]]
per_hectare = 200
[[seafloor.boulders]]
per_hectare = 150
[track]
pings = 6
[motion.roll]
rms_deg = 2
[motion.pitch]
rms_deg = 1
[motion.heading]
rms_deg = 2
)";

struct GoldenScene {
  std::string_view name, text;
};
constexpr GoldenScene golden_scenes[] = {
    // An object, noise and a signal chain.
    {"object", R"([[objects]]
shape = "cylinder"
east_m = 12
north_m = 0
[sonar.left-right]
range_m = 25
bins = 200
elevations = 256
)"},
    {"refraction", R"([sea]
profile = "cast.csv"
refraction = "full"
[sonar.left-right]
range_m = 25
bins = 200
elevations = 256
)"},
    {"beams", R"([sonar.parallel]
range_m = 25
bins = 150
elevations = 256
beams = 3
array_length_m = 0.2
receive_array_length_m = 0.6
focus_zones_m = [8, 15]
shading = "taylor"
side_lobes = 1
)"},
    // All that the signal chain can add, and a sonar with one side.
    {"signals", R"([arrivals]
surface = true
volume = true
multiples = true
second_time_around = true
burst_m = 1
crosstalk_db = -30
[artefacts]
repeated = 0.2
interference_db = 20
gain_step_db = 3
gain_step_s = 0.1
automatic_gain = 0.5
fish_per_hectare = 300
wake_db = -20
shimmer_db = 1
[navigation]
position_rms_m = 0.1
[sonar.low]
range_m = 25
bins = 200
elevations = 256
pulse = "lfm"
pulse_length_s = 0.002
looks = 3
ping_gain_db = 1
output_noise_db = -50
curve = "logarithmic"
[sonar.high]
sides = "starboard"
frequency_hz = 900000
range_m = 20
bins = 150
elevations = 256
mount_azimuth_deg = 10
port_mount_deg = 3
)"},
    {"glints", R"([arrivals]
double_bounce = true
[[objects]]
shape = "container"
material = "steel"
east_m = 12
[[objects]]
shape = "tyre"
east_m = -8
[[objects]]
shape = "mine"
count = 4
area_radius_m = 20
burial = 0.3
[sonar.left-right]
range_m = 25
bins = 400
elevations = 512
bandwidth_hz = 60000
)"},
    // Steered beams: one sonar is focused, the other has near fields. Its array is shaded.
    {"ahead", R"([[objects]]
shape = "box"
material = "concrete"
width_m = 8
north_m = 10
[[objects]]
shape = "sphere"
material = "steel"
east_m = 3
north_m = 7
[sonar.focused]
kind = "imaging"
range_m = 15
bins = 120
beams = 48
elevations = 128
tilt_deg = 30
sector_low_deg = 10
sector_high_deg = 60
[sonar.near]
kind = "imaging"
range_m = 15
bins = 100
beams = 32
elevations = 128
tilt_deg = 30
sector_low_deg = 10
sector_high_deg = 60
focused = false
receive_shading = "taylor"
side_lobes = 2
beam_steps = "sine"
field_of_view_deg = 60
looks = 2
)"}};

struct Cell {
  std::string_view intersector = "fan_scan", surface = "footprint", instruction_set;
  int block_pings = RunOptions{}.block_pings;
};

template <class T>
void append(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

/// A line for each layer of each sonar, and one for its pings: "scene sonar layer hash".
std::string hashes_of(const GoldenScene& golden, const Cell& cell = {}, int threads = 1) {
  const tests::TemporaryFolder folder;
  tests::Sea2{}.cast(folder);
  tests::write_text(folder / "scene.toml", fmt::format("{}{}", common, golden.text));
  Scene scene = read_scene(folder / "scene.toml");
  scene.run.intersector = cell.intersector;
  scene.run.surface = cell.surface;
  scene.run.intersection.instruction_set = cell.instruction_set;
  scene.run.block_pings = cell.block_pings;
  Simulator simulator(scene);
  const ScenePings all = ping_all(scene, simulator, threads);
  REQUIRE(all.hits > all.rays / 3);
  std::string lines;
  for (const Waterfall& image : all.images) {
    const auto add = [&](std::string_view layer, const std::string& bytes) {
      lines += fmt::format("{} {} {} {}\n", golden.name, image.sonar.name, layer, xxh128(bytes));
    };
    BinLayers::for_each([&](std::string_view layer, auto member) {
      std::string bytes;
      append(bytes, image.pixels.*member);
      add(layer, bytes);
    });
    add("pings", pings_csv(image));
    // An object is seen, and so are the bed's features, whose instances come after it.
    CHECK(std::ranges::max(image.pixels.instance) > (scene.objects.empty() ? 0 : 1));
  }
  return lines;
}

std::filesystem::path hashes_file() {
  return tests::source_folder() / "tests/engine/golden_hashes.txt";
}

std::string written_down(std::string_view name) {
  std::ifstream file(hashes_file());
  std::string lines;
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(fmt::format("{} ", name))) lines += line + '\n';
  return lines;
}

bool has_fused_multiply_add() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("fma") && __builtin_cpu_supports("avx2");
#else
  return false;
#endif
}

}  // namespace

TEST_CASE("the bytes of six scenes are those that were written down, layer by layer") {
  if (!has_fused_multiply_add()) {
    WARN("skipped: the hashes are those of machines with AVX2 and fused multiply-adds");
    return;
  }
  std::string all;
  for (const GoldenScene& golden : golden_scenes) {
    const std::string found = hashes_of(golden);
    CHECK(found == written_down(golden.name));
    all += found;
  }
  if (all != tests::read_text(hashes_file())) {
    const auto file = std::filesystem::temp_directory_path() / "golden_hashes.txt";
    tests::write_text(file, all);
    FAIL_CHECK("the hashes of this build are in " << file);
  }
}

TEST_CASE("the bytes of a run are the same with all intersectors") {
  if (!has_fused_multiply_add()) {
    WARN("skipped: the hashes are those of machines with AVX2 and fused multiply-adds");
    return;
  }
  // In this scene all of them hit the same faces.
  const GoldenScene& golden = golden_scenes[0];
  for (const Cell& cell : {Cell{"pluecker", "static", ""}, Cell{"embree", "static", "sse2"},
                           Cell{"embree", "static", "avx2"}}) {
    CAPTURE(cell.intersector, cell.surface, cell.instruction_set);
    CHECK(hashes_of(golden, cell) == written_down(golden.name));
  }
}

TEST_CASE("the bytes of a run are the same on every instruction set of the kernels") {
  if (!has_fused_multiply_add()) {
    WARN("skipped: the hashes are those of machines with AVX2 and fused multiply-adds");
    return;
  }
  tests::on_each_target([] {
    for (const GoldenScene& golden : golden_scenes)
      CHECK(hashes_of(golden) == written_down(golden.name));
  });
}

TEST_CASE("the bytes of a run are the same on several threads") {
  if (!has_fused_multiply_add()) {
    WARN("skipped: the hashes are those of machines with AVX2 and fused multiply-adds");
    return;
  }
  for (const GoldenScene& golden : golden_scenes)
    CHECK(hashes_of(golden, {.block_pings = 1}, 3) == hashes_of(golden, {.block_pings = 1}));
}

// If this fails because seafloors are meant to change, raise seafloor_version and copy the new
// hash: without a new version, runs would take the analysis of the old seafloor from a cache.
TEST_CASE("a seafloor that changes has another version, so that no cache has the old one") {
  if (!has_fused_multiply_add()) {
    WARN("skipped: the hashes are those of machines with AVX2 and fused multiply-adds");
    return;
  }
  const Scene scene = parse_scene(R"(version = 1
seed = 3
[seafloor]
extent_east_m = 60
extent_north_m = 50
cell_m = 0.2
depth_m = 15
fractal.height_at_1m_m = 0
[[seafloor.patches]]
share = 0.4
patch_m = 8
[[seafloor.crests]]
wavelength_m = 1.5
[[seafloor.trawl_marks]]
[[seafloor.pits]]
per_hectare = 200
[[seafloor.outcrops]]
roughness_at_1m_m = 0
[[seafloor.boulders]]
per_hectare = 150
[[objects]]
shape = "boulder"
count = 5
[[objects]]
shape = "debris"
count = 3
)",
                                  "versioned", {}, {});
  const Seafloor floor = make_seafloor(scene.seafloor, scene.bed_seed(), scene.objects);
  std::string bytes;
  append(bytes, floor.mesh.positions);
  append(bytes, floor.mesh.faces);
  append(bytes, floor.face_label);
  CHECK(seafloor_version == 23);
  CHECK(xxh128(bytes) == "833099cc041a8068ac43478810964f02");
}
