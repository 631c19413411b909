// What makes refinement worth having: every ray of a fan hits what it hits on the whole mesh.

#include <ensonify/engine/trace/exact_surface.h>

#include <cmath>

#include "support/catch.h"
#include "support/data.h"
#include "support/meshes.h"

#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/mesh_repair.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

struct Count {
  std::size_t rays = 0, hits = 0, ties = 0, differences = 0;
};

/// A fan of some size from a random place about a mesh, turned at random towards it.
RayFan random_fan(tests::Random& random, const refine::Bounds& box) {
  const Eigen::Vector3d middle = 0.5 * (box.lowest + box.highest).cast<double>();
  const double size_m = (box.highest - box.lowest).cast<double>().norm();
  const auto grid = std::make_shared<const FanGrid>(
      FanLayout{.sector_low_rad = 0.1,
                .sector_high_rad = 0.1 + tests::uniform(random, 0.3, 2.0),
                .truncation_rad = tests::uniform(random, 0.005, 0.2),
                .main_lobe_rad = 0.1,
                .planes = 6,
                .elevations = 301});
  const Eigen::Matrix3d frame = tests::frame(random);
  const Eigen::Vector3d from = middle - tests::uniform(random, 0.0, 0.8) * size_m * frame.col(1) +
                               0.1 * size_m * tests::direction(random);
  return {grid,         from,         frame.col(0),
          frame.col(1), frame.col(2), tests::uniform(random, 0.2, 1.2) * size_m};
}

/// Small steps along and about, as a sonar makes them.
RayFan moved(RayFan fan, tests::Random& random, double step_m) {
  fan.origin += step_m * tests::direction(random);
  const Eigen::AngleAxisd turn(0.002, tests::direction(random));
  fan.array_axis = turn * fan.array_axis;
  fan.middle = turn * fan.middle;
  fan.pole = turn * fan.pole;
  return fan;
}

void compare(const RayFan& fan, const Intersector& whole, const Intersector& exact, Count& count) {
  std::vector<Hit> expected(fan.grid->rays()), found(fan.grid->rays());
  whole.intersect(fan, expected);
  exact.intersect(fan, found);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ++count.rays;
    count.hits += static_cast<bool>(expected[i]);
    if (found[i].face == expected[i].face && found[i].t == expected[i].t) continue;
    ++(expected[i] && found[i].t == expected[i].t ? count.ties : count.differences);
  }
}

/// Walks of several pings, two sonars at a time, over every kind of exact surface.
Count walk(const refine::TriangleMesh& mesh,
           std::shared_ptr<const refine::ProgressiveMesh> progressive,
           const std::string& intersector, int walks, int tree_pings) {
  const auto whole = make_intersector(intersector, mesh);
  const SurfaceParts parts{
      .progressive = std::move(progressive), .intersector = intersector, .tree_pings = tree_pings};
  const auto refined = make_refined_surface(parts), footprint = make_footprint_surface(parts);
  const refine::Bounds box = refine::bounds(mesh);
  const double size_m = (box.highest - box.lowest).cast<double>().norm();
  tests::Random random(7);
  Count count;
  for (int i = 0; i < walks; ++i) {
    std::vector<RayFan> fans{random_fan(random, box), random_fan(random, box)};
    refined->reset();
    for (int ping = 0; ping < 6; ++ping) {
      for (Surface* surface : {refined.get(), footprint.get()}) {
        const Intersector& exact = surface->prepare(fans);
        for (const RayFan& fan : fans) compare(fan, *whole, exact, count);
      }
      for (RayFan& fan : fans) fan = moved(fan, random, 2e-4 * size_m);
    }
  }
  return count;
}

}  // namespace

TEST_CASE("Refined and footprint surfaces give each ray the hit of the whole mesh, to the bit") {
  for (const tests::NamedMesh& named : tests::manifold_meshes(false)) {
    CAPTURE(named.name);
    const auto progressive = make_progressive_mesh(named.mesh);
    for (const char* intersector : {"embree", "pluecker"})
      for (const int tree_pings : {1, 4}) {
        CAPTURE(intersector, tree_pings);
        const Count count = walk(named.mesh, progressive, intersector, 4, tree_pings);
        CHECK(count.differences == 0);
        CHECK(count.ties <= count.rays / 10000);
        if (named.mesh.faces.size() > 100) CHECK(count.hits > count.rays / 20);
      }
  }
}

TEST_CASE("A real wreck, several bodies and all, is hit through its exact faces as it is whole") {
  const auto file = tests::data_file("mesh_underwater/skytteren_wreck.ply");
  if (!file) {
    WARN("skipped: the real data are not there");
    return;
  }
  const refine::TriangleMesh wreck = refine::repair(refine::read_mesh(*file)).mesh;
  const Count count = walk(wreck, make_progressive_mesh(wreck), "embree", 20, 1);
  CHECK(count.hits > count.rays / 10);
  CHECK(count.differences == 0);
  CHECK(count.ties <= count.rays / 10000);
}

TEST_CASE(
    "Spheres that leave out a part of the closed star lose hits, and the comparison sees it") {
  const refine::TriangleMesh bed = tests::open_grid(40, 40, 0.5, 0.4, 3);
  refine::ProgressiveMeshArrays broken = tests::arrays_of(*make_progressive_mesh(bed));
  for (refine::Sphere& sphere : broken.spheres) sphere.radius *= 0.7f;
  const Count count = walk(bed, std::make_shared<refine::ProgressiveMesh>(broken), "embree", 6, 1);
  CHECK(count.differences > count.hits / 1000);
}

TEST_CASE(
    "A tree that is meant to do for several pings is not built at each, and not kept too long") {
  const refine::TriangleMesh bed = tests::open_grid(40, 40, 0.5, 0.4, 3);
  const SurfaceParts parts{
      .progressive = make_progressive_mesh(bed), .intersector = "embree", .tree_pings = 5};
  const auto whole = make_intersector("embree", bed);
  const auto surface = make_footprint_surface(parts);
  SurfaceParts for_one = parts;
  for_one.tree_pings = 1;
  const auto alone = make_footprint_surface(for_one);
  tests::Random random(3);
  // Over the bed's middle, looking down to one side.
  const refine::Bounds box = refine::bounds(bed);
  const double half = std::sqrt(0.5);
  RayFan fan = random_fan(random, box);
  fan.origin = (0.5f * (box.lowest + box.highest)).cast<double>();
  fan.origin.z() = box.highest.z() + 2.0;
  fan.array_axis = Eigen::Vector3d::UnitY();
  fan.middle = {half, 0.0, -half};
  fan.pole = {half, 0.0, half};
  fan.range_m = 8.0;
  Count count;
  for (int ping = 0; ping < 40; ++ping) {
    fan.origin += 0.05 * fan.array_axis;
    if (ping == 20) fan.origin += 3.0 * fan.array_axis;  // a jump
    compare(fan, *whole, surface->prepare({&fan, 1}), count);
    alone->prepare({&fan, 1});
    const std::size_t faces = surface->triangles().faces.size();
    const std::size_t needed = alone->triangles().faces.size();
    if (ping == 20) CHECK(faces == needed);  // nothing says that it will jump again
    if (ping == 2) CHECK(faces > needed);
  }
  CHECK(count.hits > 1000);
  CHECK(count.differences == 0);
}
