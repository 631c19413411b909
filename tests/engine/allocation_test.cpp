#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <new>
#include <numeric>
#include <utility>
#include <vector>

#include "support/catch.h"
#include "support/files.h"
#include "support/grids.h"
#include "support/spare_thread.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/sonar/instrument/presets.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/footprint.h>

namespace {
std::atomic<std::size_t> allocations = 0;
std::atomic<std::ptrdiff_t> alive = 0;
std::atomic<std::size_t> failing = 0;  // the allocation of this count; 0: none
}  // namespace

// NOLINTBEGIN(cppcoreguidelines-no-malloc): containers and smart pointers call these functions.
// Counts every C++ allocation of this test program.
void* operator new(std::size_t size) {
  if (++allocations == failing) throw std::bad_alloc();
  ++alive;
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  ++alive;
  return std::malloc(size > 0 ? size : 1);
}
void* operator new(std::size_t size, std::align_val_t line) {
  ++allocations;
  ++alive;
  const auto to = static_cast<std::size_t>(line);
  if (void* memory = std::aligned_alloc(to, (size + to) / to * to)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  alive -= memory != nullptr;
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept { operator delete(memory); }
void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }
// NOLINTEND(cppcoreguidelines-no-malloc)

using namespace ensonify;
using namespace ensonify::engine;

namespace {

Scene static_scene() {
  Scene scene;
  scene.seafloor.extent_east_m = 100.0;
  scene.seafloor.extent_north_m = 40.0;
  scene.seafloor.cell_m = 0.5;
  scene.track.pings = 60;
  scene.sonars.front().range_m = 40.0;
  scene.sonars.front().bins = 200;
  scene.sonars.front().elevations = 300;
  scene.run.surface = "static";  // Embree allocates when it builds a tree
  return scene;
}

}  // namespace

TEST_CASE("a steady ping allocates nothing") {
  Scene scene = static_scene();
  SECTION("with Embree's tree over all faces") { scene.run.intersector = "embree"; }
  SECTION("with a scan of the fan's own faces") {
    scene.run.intersector = "fan_scan";
    scene.run.surface = "footprint";
  }
  const tests::TemporaryFolder folder;
  SECTION("with bent rays, some of which turn") {
    tests::write_text(folder / "cast.csv",
                      "depth_m,soundspeed_mps\n0,1520\n5,1520\n9,1480\n15,1490\n40,1492\n");
    scene.sea.profile = {"cast.csv", folder / "cast.csv"};
    scene.sea.refraction = RefractionMode::full;
  }
  SECTION("with the ground's texture") { scene.texture = true; }
  SECTION("near objects whose visible share is counted") {
    for (const double east_m : {-12.0, 9.0, 20.0})
      scene.objects.push_back({.shape = "sphere", .east_m = east_m});
  }
  SECTION("of an imaging sonar, with objects") {
    scene.sonars.front() = usual_sonar(SonarKind::imaging);
    scene.sonars.front().bins = 200;
    scene.sonars.front().beams = 64;
    scene.sonars.front().elevations = 128;
    scene.track.pings = 12;
    for (const double east_m : {-12.0, 9.0, 20.0})
      scene.objects.push_back({.shape = "sphere", .east_m = east_m});
  }
  SECTION("with multiples, walls and a pulse longer than a bin") {
    scene.arrivals.multiples = scene.arrivals.double_bounce = true;
    scene.sonars.front().pulse.bandwidth_hz = 1e3;
    for (const double east_m : {-12.0, 9.0, 20.0})
      scene.objects.push_back({.shape = "box", .east_m = east_m});
  }
  Simulator simulator(scene);
  const std::vector<Pose> poses = simulator.track();
  for (std::size_t i = 0; i < poses.size(); ++i) simulator.ping_numbered(poses[i], i);
  SimulatorInternals::reset(simulator);
  const std::size_t before = allocations;
  for (std::size_t i = 0; i < poses.size(); ++i) simulator.ping_numbered(poses[i], i);
  CHECK(allocations == before);
  CHECK(before > 0);  // the counter works
}

TEST_CASE(
    "a steady ping whose faces a spare thread prepared allocates nothing, nor does that thread") {
  Scene scene = static_scene();
  scene.run.intersector = "fan_scan";
  scene.run.surface = "footprint";
  scene.run.tree_pings = 1;
  Simulator simulator(scene);
  const std::vector<Pose> poses = simulator.track();
  std::vector<std::size_t> places(poses.size());
  std::iota(places.begin(), places.end(), std::size_t{0});
  tests::SpareThread spare;
  std::size_t before = 0;
  // In each round the two sets of faces have changed places: twice to warm up.
  for (int round = 0; round < 3; ++round) {
    before = allocations;
    SimulatorInternals::reset(simulator);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      SimulatorInternals::announce(simulator, poses, std::span(places).subspan(i + 1),
                                   spare.threads);
      simulator.ping_numbered(poses[i], i);
      spare.settle();
    }
  }
  CHECK(allocations == before);
  CHECK(before > 0);
}

TEST_CASE("a steady ping of a moving object allocates nothing, and its removal frees its memory") {
  Scene scene = static_scene();
  scene.run.intersector = "fan_scan";
  scene.run.surface = "footprint";
  Simulator simulator(scene);
  const std::vector<Pose> poses = simulator.track();
  const refine::TriangleMesh plate{.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}},
                                   .faces = {{0, 1, 2}}};
  const std::uint32_t instance = simulator.add({.mesh = plate}, poses.front());
  const auto build_track = [&] {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      Pose beside = poses[i];
      beside.position += Eigen::Vector3d(10.0, 0.0, -4.0);
      simulator.move(instance, beside);
      simulator.ping_numbered(poses[i], i);
    }
  };
  build_track();
  SimulatorInternals::reset(simulator);
  const std::size_t before = allocations;
  build_track();
  CHECK(allocations == before);

  std::ptrdiff_t alive_before = 0;
  for (int round = 0; round < 1001; ++round) {
    if (round == 1) alive_before = alive;
    const std::uint32_t other = simulator.add({.mesh = plate}, poses.front());
    REQUIRE(other == instance + 1);
    if (round % 100 == 0) simulator.ping_numbered(poses.front(), 0);
    simulator.remove(other);
  }
  CHECK(alive == alive_before);
}

TEST_CASE("a steady refinement allocates nothing, nor does a steady query") {
  Simulator simulator(static_scene());
  std::vector<std::array<refine::FanVolume, 2>> pings;
  for (const Pose& pose : simulator.track()) {
    const std::span<const RayFan> fans = SimulatorInternals::aim(simulator, pose);
    pings.push_back({fan_volume_of(fans[0]), fan_volume_of(fans[1])});
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

TEST_CASE("an add() that runs out of memory changes nothing, and can be called again") {
  Scene scene = static_scene();
  scene.sonars.front().bins = 50;
  const Simulator whole(scene);
  const MovingObject object{.mesh = {.positions = {{-2, -2, 0}, {2, -2, 0}, {0, 2, 0}, {0, 0, 3}},
                                     .faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}},
                            .material = "steel",
                            .class_name = "pyramid"};
  const Pose place{.position = {8, 0, -19}};
  const auto heard = [](Simulator& session) {
    const EchoLine& line = session.ping_numbered({.position = {0, 0, -12}}, 0)[1];
    return std::pair(line.bins.intensity, line.bins.instance);
  };
  Simulator session = whole.clone_for_thread();
  const auto without = heard(session);
  const std::size_t before = allocations;
  session.add(object, place);
  const std::size_t needed = allocations - before;
  const auto with = heard(session);
  REQUIRE(with != without);
  REQUIRE(needed > 40);
  std::size_t failed = 0;
  for (std::size_t left = 0; left < 40; ++left) {
    CAPTURE(left);
    session = whole.clone_for_thread();
    failing = allocations + needed - left;
    bool fails = false;
    try {
      session.add(object, place);
    } catch (const std::bad_alloc&) {
      fails = true;
    }
    failing = 0;
    if (!fails) continue;  // an allocation that may fail, as of a sort
    ++failed;
    CHECK(session.next_instance() == 1);
    CHECK(session.materials().size() == whole.materials().size());
    CHECK(session.classes().size() == whole.classes().size());
    CHECK((heard(session) == without));
    CHECK(session.add(object, place) == 1);
    CHECK((heard(session) == with));
  }
  CHECK(failed > 30);
}
