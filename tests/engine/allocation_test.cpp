#include <array>
#include <atomic>
#include <cstdlib>
#include <new>
#include <vector>

#include "support/catch.h"

#include <ensonify/engine/simulate.h>
#include <ensonify/engine/trace/exact_surface.h>
#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/footprint.h>

namespace {
std::atomic<std::size_t> allocations = 0;
}

// Counts every C++ allocation of this test program.
void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size > 0 ? size : 1);
}
void* operator new(std::size_t size, std::align_val_t line) {
  ++allocations;
  const auto to = static_cast<std::size_t>(line);
  if (void* memory = std::aligned_alloc(to, (size + to) / to * to)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

using namespace ensonify;
using namespace ensonify::engine;

namespace {

Scene small_scene() {
  Scene scene;
  scene.seafloor.extent_east_m = 100.0;
  scene.seafloor.extent_north_m = 40.0;
  scene.seafloor.cell_m = 0.5;
  scene.track.pings = 60;
  scene.sonars.front().range_m = 40.0;
  scene.sonars.front().bins = 200;
  scene.sonars.front().elevations = 300;
  scene.run.surface = "static";  // a tree that is built anew is Embree's own business
  return scene;
}

}  // namespace

TEST_CASE("a steady ping allocates nothing") {
  Scene scene = small_scene();
  SECTION("with Embree's tree over all faces") {}
  SECTION("with a scan of the fan's own faces") {
    scene.run.intersector = "fan_scan";
    scene.run.surface = "footprint";
  }
  Simulator simulator(scene);
  const std::vector<Pose> poses = simulator.track();
  for (std::size_t i = 0; i < poses.size(); ++i) simulator.ping(poses[i], i);
  simulator.reset();
  const std::size_t before = allocations;
  for (std::size_t i = 0; i < poses.size(); ++i) simulator.ping(poses[i], i);
  CHECK(allocations == before);
  CHECK(before > 0);  // the count counts
}

TEST_CASE("a steady refinement allocates nothing, nor does a steady query") {
  Simulator simulator(small_scene());
  std::vector<std::array<refine::ViewVolume, 2>> pings;
  for (const Pose& pose : simulator.track()) {
    const std::span<const RayFan> fans = simulator.aim(pose);
    pings.push_back({view_volume(fans[0]), view_volume(fans[1])});
  }
  const auto progressive = make_progressive_mesh(simulator.seafloor().mesh);
  refine::ActiveMesh active(*progressive);
  refine::Footprint footprint(*progressive);
  std::size_t before = 0, faces = 0;
  // Twice to warm up: the two lists of exact faces change places at each refinement.
  for (int round = 0; round < 3; ++round) {
    before = allocations;
    active.reset();
    for (const auto& volumes : pings) {
      active.refine(volumes);
      faces += active.exact_faces().faces.size();
      faces += footprint.query(volumes).faces.size();
    }
  }
  CHECK(allocations == before);
  CHECK(faces > 10000);
}
