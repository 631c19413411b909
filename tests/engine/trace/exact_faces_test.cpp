// The purpose of refinement: every ray of a fan has the same hit as on the whole mesh.

#include <ensonify/engine/trace/face_sources/exact_faces.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "support/catch.h"
#include "support/data.h"
#include "support/heights.h"
#include "support/meshes.h"
#include "support/spare_thread.h"

#include <ensonify/refine/ball_tree.h>
#include <ensonify/refine/height_grid.h>
#include <ensonify/refine/height_tiles.h>
#include <ensonify/refine/mesh_clusters.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/mesh_repair.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

struct RayCount {
  std::size_t rays = 0, hits = 0, differences = 0;
};

/// A random fan near a mesh, turned towards it.
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

/// Small steps and rotations, as of a sonar.
RayFan moved(RayFan fan, tests::Random& random, double step_m) {
  fan.origin += step_m * tests::direction(random);
  const Eigen::AngleAxisd turn(0.002, tests::direction(random));
  fan.array_axis = turn * fan.array_axis;
  fan.middle = turn * fan.middle;
  fan.pole = turn * fan.pole;
  return fan;
}

void compare_with_whole(const RayFan& fan, const Intersector& whole, const Intersector& exact,
                        RayCount& count) {
  std::vector<Hit> expected(fan.grid->rays()), found(fan.grid->rays());
  whole.intersect(fan, expected);
  exact.intersect(fan, found);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ++count.rays;
    count.hits += static_cast<bool>(expected[i]);
    count.differences += found[i].face != expected[i].face || found[i].t != expected[i].t ||
                         found[i].u != expected[i].u || found[i].v != expected[i].v;
  }
}

/// Walks of several pings with two sonars, over every kind of exact face source.
RayCount walk(const refine::TriangleMesh& mesh,
              std::shared_ptr<const refine::ProgressiveMesh> progressive,
              const std::string& intersector, int walks, int tree_pings) {
  const auto whole = make_intersector(intersector, mesh);
  const FaceSourceParts parts{
      .progressive = std::move(progressive), .intersector = intersector, .tree_pings = tree_pings};
  const auto refined = make_refined_faces(parts), footprint = make_footprint_faces(parts);
  const refine::Bounds box = refine::bounds(mesh);
  const double size_m = (box.highest - box.lowest).cast<double>().norm();
  tests::Random random(7);
  RayCount count;
  for (int i = 0; i < walks; ++i) {
    std::vector<RayFan> fans{random_fan(random, box), random_fan(random, box)};
    refined->reset();
    for (int ping = 0; ping < 6; ++ping) {
      for (FaceSource* surface : {refined.get(), footprint.get()}) {
        const Intersector& exact = *surface->prepare(fans).intersector;
        for (const RayFan& fan : fans) compare_with_whole(fan, *whole, exact, count);
      }
      for (RayFan& fan : fans) fan = moved(fan, random, 2e-4 * size_m);
    }
  }
  return count;
}

}  // namespace

TEST_CASE("Refined and footprint faces give each ray the hit of the whole mesh, to the bit") {
  for (const tests::NamedMesh& named : tests::manifold_meshes(false)) {
    CAPTURE(named.name);
    const auto progressive = make_progressive_mesh(named.mesh);
    for (const char* intersector : {"embree", "embree-single", "pluecker", "fan_scan"})
      for (const int tree_pings : {1, 4}) {
        CAPTURE(intersector, tree_pings);
        const RayCount count = walk(named.mesh, progressive, intersector, 4, tree_pings);
        CHECK(count.differences == 0);
        if (named.mesh.faces.size() > 100) CHECK(count.hits > count.rays / 20);
      }
  }
}

TEST_CASE(
    "Rays hit a real wreck of several bodies through its exact faces as through the whole mesh") {
  const auto file = tests::data_file("mesh_underwater/skytteren_wreck.ply");
  if (!file) {
    WARN("skipped: the real data are missing");
    return;
  }
  const refine::TriangleMesh wreck = refine::repair(refine::read_mesh(*file)).mesh;
  const RayCount count = walk(wreck, make_progressive_mesh(wreck), "embree", 20, 1);
  CHECK(count.hits > count.rays / 10);
  CHECK(count.differences == 0);
}

TEST_CASE(
    "Spheres that leave out a part of the closed star lose hits, and the comparison finds it") {
  const refine::TriangleMesh bed = tests::open_grid(40, 40, 0.5, 0.4, 3);
  refine::ProgressiveMeshArrays broken = tests::arrays_of(*make_progressive_mesh(bed));
  for (refine::Sphere& sphere : broken.spheres) sphere.radius *= 0.7f;
  const RayCount count =
      walk(bed, std::make_shared<refine::ProgressiveMesh>(broken), "embree", 6, 1);
  CHECK(count.differences > count.hits / 1000);
}

namespace {

/// A fan above a place, looking down to one side.
RayFan fan_beside(const Eigen::Vector3d& place) {
  tests::Random random(3);
  const double half = std::sqrt(0.5);
  RayFan fan = random_fan(random, {Eigen::Vector3f::Zero(), Eigen::Vector3f::Ones()});
  fan.origin = place;
  fan.array_axis = Eigen::Vector3d::UnitY();
  fan.middle = {half, 0.0, -half};
  fan.pole = {half, 0.0, half};
  fan.range_m = 8.0;
  return fan;
}

}  // namespace

TEST_CASE(
    "Faces prepared by a spare thread give each ray the same hit, and do not change those in use") {
  const refine::TriangleMesh bed = tests::open_grid(40, 40, 0.5, 0.4, 3);
  const refine::Bounds box = refine::bounds(bed);
  const Eigen::Vector3d middle = (0.5f * (box.lowest + box.highest)).cast<double>();
  tests::SpareThread spare;
  for (const auto& [make, intersector] :
       {std::pair{&make_refined_faces, "embree"}, std::pair{&make_footprint_faces, "fan_scan"}})
    for (const int tree_pings : {1, 4}) {
      CAPTURE(intersector, tree_pings);
      const auto whole = make_intersector(intersector, bed);
      const auto surface = make({.progressive = make_progressive_mesh(bed),
                                 .intersector = intersector,
                                 .tree_pings = tree_pings});
      RayCount count;
      int made_ahead = 0;
      Faces before;
      for (int ping = 0; ping < 60; ++ping) {
        const auto at = [&](int p) {
          const double along_m = 0.05 * p - (p > 40 ? 2.0 : 0.0);  // with one leap
          return fan_beside(middle + Eigen::Vector3d(0.0, along_m, 2.0));
        };
        const RayFan fan = at(ping);
        const Faces faces = surface->prepare({&fan, 1});
        const Intersector& exact = *faces.intersector;
        if (before.intersector && faces.intersector != before.intersector) {
          CHECK(faces.version != before.version);
          ++made_ahead;
        }
        before = faces;
        bool does = true;
        for (int next = ping + 1; does && next < ping + 6; ++next) {
          // Sometimes another ping comes than was announced.
          const RayFan expected = at(ping % 7 == 0 ? next + 20 : next);
          does = surface->announce({&expected, 1}, spare.threads);
        }
        compare_with_whole(fan, *whole, exact, count);  // while it is being prepared
        spare.settle();
        compare_with_whole(fan, *whole, exact, count);  // and when it is ready
        if (ping == 30) surface->reset();
      }
      CHECK(made_ahead > 30 / tree_pings);
      CHECK(count.hits > 1000);
      CHECK(count.differences == 0);
    }
}

TEST_CASE("Damage found by a spare thread is reported only to the ping that needs those faces") {
  const refine::TriangleMesh bed = tests::open_grid(60, 20, 0.5, 0.4, 3);
  const refine::Bounds box = refine::bounds(bed);
  const Eigen::Vector3d middle = (0.5f * (box.lowest + box.highest)).cast<double>();
  const double end_m = 0.8 * (box.highest.x() - middle.x());
  refine::ProgressiveMeshArrays broken = tests::arrays_of(*make_progressive_mesh(bed));
  for (std::size_t node = 0; node < broken.mid.size(); ++node)
    if (broken.spheres[node].centre.x() > middle.x() + 0.5 * end_m &&
        broken.spheres[node].radius < 2.0f)
      broken.mid[node] = 0;
  const auto progressive = std::make_shared<refine::ProgressiveMesh>(broken);
  const RayFan sound = fan_beside(middle + Eigen::Vector3d(-end_m, 0.0, 2.0));
  const RayFan damaged = fan_beside(middle + Eigen::Vector3d(end_m - 4.0, 0.0, 2.0));
  const auto whole = make_intersector("embree", bed);
  tests::SpareThread spare;
  for (const auto make : {&make_refined_faces, &make_footprint_faces}) {
    const auto surface = make({.progressive = progressive, .intersector = "embree"});
    RayCount count;
    for (int round = 0; round < 3; ++round) {
      RayFan fan = sound;
      for (int ping = 0; ping < 3; ++ping) {
        fan.origin.y() += 0.1;
        const Intersector& exact = *surface->prepare({&fan, 1}).intersector;
        CHECK_FALSE(surface->announce({&damaged, 1}, spare.threads));
        spare.settle();
        compare_with_whole(fan, *whole, exact, count);
      }
      CHECK_THROWS_AS(surface->prepare({&damaged, 1}), refine::DamagedFile);
      surface->reset();
    }
    CHECK(count.hits > 100);
    CHECK(count.differences == 0);
  }
}

TEST_CASE("A tree for several pings is not built for each, and not kept too long") {
  const refine::TriangleMesh bed = tests::open_grid(40, 40, 0.5, 0.4, 3);
  const FaceSourceParts parts{
      .progressive = make_progressive_mesh(bed), .intersector = "embree", .tree_pings = 5};
  const auto whole = make_intersector("embree", bed);
  const auto surface = make_footprint_faces(parts);
  FaceSourceParts for_one = parts;
  for_one.tree_pings = 1;
  const auto alone = make_footprint_faces(for_one);
  tests::Random random(3);
  // Above the bed's middle, looking down to one side.
  const refine::Bounds box = refine::bounds(bed);
  const double half = std::sqrt(0.5);
  RayFan fan = random_fan(random, box);
  fan.origin = (0.5f * (box.lowest + box.highest)).cast<double>();
  fan.origin.z() = box.highest.z() + 2.0;
  fan.array_axis = Eigen::Vector3d::UnitY();
  fan.middle = {half, 0.0, -half};
  fan.pole = {half, 0.0, half};
  fan.range_m = 8.0;
  RayCount count;
  std::vector<int> built_at;
  std::uint64_t version = 0;
  for (int ping = 0; ping < 40; ++ping) {
    if (ping == 20) fan.origin.y() += 3.0;  // a jump
    fan.origin += Eigen::Vector3d(0.0, 0.041, 0.003);
    if (ping > 31) {  // turns while moving
      const Eigen::AngleAxisd turn(0.002, Eigen::Vector3d::UnitZ());
      fan.array_axis = turn * fan.array_axis;
      fan.middle = turn * fan.middle;
      fan.pole = turn * fan.pole;
    }
    const Faces kept = surface->prepare({&fan, 1});
    compare_with_whole(fan, *whole, *kept.intersector, count);
    if (std::exchange(version, kept.version) != kept.version) built_at.push_back(ping);
    const std::size_t faces = kept.triangles.faces.size();
    const std::size_t needed = alone->prepare({&fan, 1}).triangles.faces.size();
    if (ping == 20) CHECK(faces == needed);  // no second jump is expected
    if (ping == 2) CHECK(faces > needed);
  }
  // Five pings each, except at first, at the jump and soon after the turn begins.
  CHECK(built_at == std::vector{0, 1, 6, 11, 16, 20, 21, 26, 31, 34, 39});
  CHECK(count.hits > 1000);
  CHECK(count.differences == 0);
}

TEST_CASE("A spare thread makes the tiles and clusters that the sonar will reach much later") {
  const std::string kind = GENERATE("footprint", "refined");
  CAPTURE(kind);
  const tests::Heights heights = tests::random_heights(300, 4200, 0.5, 0.5, 0.0, 21);
  const auto tiles = heights.tiles();
  const auto grid = std::make_shared<const refine::HeightGrid>(tiles);
  FaceSourceParts parts{.grid = grid,
                        .objects = std::make_shared<const refine::BallTree>(),
                        .intersector = "fan_scan",
                        .tree_pings = 5};
  if (kind == "refined")
    parts.clusters =
        std::make_shared<refine::MeshClusters>(*grid, refine::TriangleMesh{}, "", "key");
  const auto surface = kind == "refined" ? make_refined_faces(parts) : make_footprint_faces(parts);
  // Tiles are made in four chunks of 1024 rows; the vehicle goes north by 0.8 m per ping.
  const double first_border_m = heights.y_m()[refine::HeightTiles::chunk_cells];
  tests::Random random(3);
  RayFan fan = random_fan(random, grid->bounds());
  const double half = std::sqrt(0.5);
  fan.origin = {0.0, first_border_m - 140.0, 6.0};
  fan.array_axis = Eigen::Vector3d::UnitY();
  fan.middle = {half, 0.0, -half};
  fan.pole = {half, 0.0, half};
  fan.range_m = 20.0;
  const auto next = [](RayFan of) {
    of.origin.y() += 0.8;
    return of;
  };
  tests::SpareThread spare;
  const std::size_t of_one_chunk = 5 * 16;
  std::size_t analysed = 0;
  for (int ping = 0; ping < 8; ++ping) {
    surface->prepare({&fan, 1});
    if (ping == 0) CHECK(tiles->tiles_made() == of_one_chunk);
    if (ping == 0 && parts.clusters) analysed = parts.clusters->analysed();
    for (RayFan later = next(fan); surface->announce({&later, 1}, spare.threads);)
      later = next(later);
    spare.settle();
    fan = next(fan);
  }
  // 200 pings ahead are 160 m: beyond the border, which the sonar itself has not reached.
  REQUIRE(fan.origin.y() + 30.0 < first_border_m);
  CHECK(tiles->tiles_made() == 2 * of_one_chunk);
  if (parts.clusters) CHECK(parts.clusters->analysed() > analysed);
}
