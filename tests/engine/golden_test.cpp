// The bytes of a run against a hash that is written down here. All other tests compare a run with
// another run of the same program; this one finds changes from version to version.
//
// A hash that changed is a change for everyone who keeps datasets: mend the cause, or, if the new
// bytes are the right ones, copy what the failure prints to golden_hash and say in the commit and
// in CHANGELOG.md what changed and why.
//
// The seafloor has no spectral relief, because another build of FFTW may choose other code. The C
// library chooses its own, too, so the test needs a machine with fused multiply-adds.

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "support/catch.h"
#include "support/targets.h"

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/ping_all.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

// Objects, pits and boulders, a vehicle that moves, noise and a signal chain.
constexpr const char* golden_scene = R"(version = 1
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
[[objects]]
shape = "cylinder"
east_m = 12
north_m = 0
[track]
pings = 6
[sonar.left-right]
range_m = 25
bins = 200
elevations = 256
[motion.roll]
rms_deg = 2
[motion.pitch]
rms_deg = 1
[motion.heading]
rms_deg = 2
)";

Scene scene_of(std::string_view intersector, std::string_view surface,
               std::string_view instruction_set) {
  Scene scene = parse_scene(golden_scene, "golden", {}, {});
  scene.run.intersector = intersector;
  scene.run.surface = surface;
  scene.run.intersection.instruction_set = instruction_set;
  return scene;
}

template <class T>
void append(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

/// Of all layers of all pings, in the files' order.
std::string hash_of_run(const Scene& scene) {
  Simulator simulator(scene);
  const ScenePings all = ping_all(scene, simulator, 1);
  REQUIRE(all.hits > all.rays / 2);
  // The object is seen, and so are the bed's features, whose instances come after it.
  REQUIRE(std::ranges::count(all.images.front().pixels.instance, 1u) > 0);
  REQUIRE(std::ranges::max(all.images.front().pixels.instance) > 1);
  std::string bytes;
  for (const Waterfall& image : all.images)
    BinLayers::for_each([&](std::string_view, auto layer) { append(bytes, image.pixels.*layer); });
  return xxh128(bytes);
}

bool has_fused_multiply_add() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("fma") && __builtin_cpu_supports("avx2");
#else
  return false;
#endif
}

constexpr std::string_view golden_hash = "49df397aba031af1520d7161d58af97c";

struct Cell {
  std::string_view intersector, surface, instruction_set;
};

}  // namespace

TEST_CASE("the bytes of a run are those that were written down") {
  if (!has_fused_multiply_add()) {
    WARN("skipped: the hash is that of machines with AVX2 and fused multiply-adds");
    return;
  }
  // In this scene all back-ends hit the same faces, so they share one hash.
  for (const Cell& cell : {Cell{"pluecker", "static", ""}, Cell{"fan_scan", "footprint", ""},
                           Cell{"embree", "static", "sse2"}, Cell{"embree", "static", "avx2"}}) {
    CAPTURE(cell.intersector, cell.surface, cell.instruction_set);
    CHECK(hash_of_run(scene_of(cell.intersector, cell.surface, cell.instruction_set)) ==
          golden_hash);
  }
}

TEST_CASE("the bytes of a run are the same on every instruction set of the kernels") {
  if (!has_fused_multiply_add()) {
    WARN("skipped: the hash is that of machines with AVX2 and fused multiply-adds");
    return;
  }
  tests::on_each_target(
      [] { CHECK(hash_of_run(scene_of("fan_scan", "footprint", "")) == golden_hash); });
}

// If this fails because seafloors are meant to change, raise seafloor_version and copy the new
// hash: without a new version, runs would take the analysis of the old seafloor from a cache.
TEST_CASE("a seafloor that changes has another version, so that no cache has the old one") {
  if (!has_fused_multiply_add()) {
    WARN("skipped: the hash is that of machines with AVX2 and fused multiply-adds");
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
