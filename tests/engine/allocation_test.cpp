#include <atomic>
#include <cstdlib>
#include <new>

#include "support/catch.h"

#include <ensonify/engine/simulate.h>

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
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

TEST_CASE("a steady ping allocates nothing") {
  using namespace ensonify::engine;
  Scene scene;
  scene.seafloor.extent_east_m = 100.0;
  scene.seafloor.extent_north_m = 40.0;
  scene.seafloor.cell_m = 0.5;
  scene.track.pings = 60;
  scene.sonars.front().range_m = 40.0;
  scene.sonars.front().bins = 200;
  scene.sonars.front().elevations = 300;
  Simulator simulator(scene);
  const std::vector<Pose> poses = simulator.track();
  for (std::size_t i = 0; i < poses.size(); ++i) simulator.ping(poses[i], i);
  const std::size_t before = allocations;
  for (std::size_t i = 0; i < poses.size(); ++i) simulator.ping(poses[i], i);
  CHECK(allocations == before);
  CHECK(before > 0);  // the count counts
}
