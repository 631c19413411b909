#include <ensonify/refine/footprint.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/refine/edge_collapse.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/mesh_repair.h>
#include <ensonify/scatter/angle.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/meshes.h"
#include "support/touched_faces.h"

using namespace ensonify::refine;
using ensonify::scatter::degree;
using ensonify::tests::over_vertices_only;
using ensonify::tests::Random;
using ensonify::tests::random_volume;
using ensonify::tests::touched_faces;
using ensonify::tests::uniform;

namespace {

std::set<std::uint32_t> query(Footprint& footprint, std::span<const FanVolume> volumes) {
  const ExactFaces exact = footprint.query(volumes);
  CHECK(exact.faces.size() == exact.source_faces.size());
  return {exact.source_faces.begin(), exact.source_faces.end()};
}

struct Count {
  std::size_t lost = 0, touched = 0, found = 0;
};
/// Counts touched faces that the footprint lost, over many volumes.
Count compare(const TriangleMesh& source, const ProgressiveMesh& mesh, double size_m, int volumes) {
  Random random(7);
  Footprint footprint(mesh);
  Count count;
  for (int i = 0; i < volumes; ++i) {
    const FanVolume v = random_volume(random, size_m);
    const std::set<std::uint32_t> found = query(footprint, {&v, 1});
    for (const std::uint32_t f : touched_faces(source, v, random)) {
      count.lost += !found.contains(f);
      ++count.touched;
    }
    count.found += found.size();
  }
  return count;
}

}  // namespace

TEST_CASE("the footprint has every face that touches the fan volume") {
  for (const auto& [name, source] : ensonify::tests::manifold_meshes()) {
    INFO(name);
    const ProgressiveMesh mesh = build_by_edge_collapse(source);
    const Count count = compare(source, mesh, 60.0, 20);
    CHECK(count.touched > 100);
    CHECK(count.lost == 0);
    CHECK(count.found < 6 * count.touched);

    // Spheres around only the vertices lose faces.
    CHECK(compare(source, over_vertices_only(mesh), 60.0, 20).lost > count.touched / 50);
  }
}

TEST_CASE("the footprint has every face of real meshes that touches the fan volume") {
  const auto [file, size_m] =
      GENERATE(table<std::string, double>({{"mesh_underwater/skytteren_wreck.ply", 200.0},
                                           {"mesh_underwater/coral_mcap.ply", 0.5},
                                           {"bathymetry/ncei19_nantucket_a.obj", 1300.0}}));
  const auto path = ensonify::tests::data_file(file);
  if (!path) {
    WARN("skipped: " << file << " is missing");
    return;
  }
  INFO(file);
  const TriangleMesh source = repair(read_mesh(*path)).mesh;
  const Count count = compare(source, build_by_edge_collapse(source), size_m, 20);
  CHECK(count.touched > 100);
  CHECK(count.lost == 0);
}

TEST_CASE(
    "every face that a ray of the fan meets is in the footprint, at edges and range limit too") {
  const TriangleMesh source = ensonify::tests::overhang(40, 40, 1.0, 5);
  const ProgressiveMesh mesh = build_by_edge_collapse(source);
  Footprint footprint(mesh);
  Random random(8);
  std::size_t met = 0, lost = 0;
  for (int i = 0; i < 30; ++i) {
    FanVolume v = random_volume(random, 60.0);
    for (int k = 0; k < 60; ++k) {
      const double e = k % 3   ? uniform(random, v.elevation_low_rad, v.elevation_high_rad)
                       : k % 2 ? v.elevation_low_rad
                               : v.elevation_high_rad;
      const double widest = std::asin(std::min(1.0, std::sin(v.truncation_rad) / std::cos(e)));
      const double phi = k % 4 ? widest * (k % 4 - 2) : uniform(random, -widest, widest);
      const Eigen::Vector3d d =
          std::cos(e) * (std::cos(phi) * v.middle + std::sin(phi) * v.array_axis) +
          std::sin(e) * v.pole;
      for (std::uint32_t f = 0; f < source.faces.size(); ++f) {
        const Triangles all = source;
        const Eigen::Vector3d a = all.corner(f, 0), ab = all.corner(f, 1) - a,
                              ac = all.corner(f, 2) - a;
        const Eigen::Vector3d n = d.cross(ac);
        const double det = ab.dot(n);
        if (det == 0.0) continue;
        const Eigen::Vector3d o = v.apex - a, q = o.cross(ab);
        const double u = o.dot(n) / det, w = d.dot(q) / det, t = ac.dot(q) / det;
        if (u < 0.0 || w < 0.0 || u + w > 1.0 || t < 0.0) continue;
        // The ray ends at the hit: the fan's range just reaches it.
        v.range_m = t;
        ++met;
        lost += !query(footprint, {&v, 1}).contains(f);
      }
    }
  }
  CHECK(met > 500);
  CHECK(lost == 0);
}

TEST_CASE("a footprint's faces are the source's, corner by corner") {
  const TriangleMesh source =
      ensonify::tests::shuffled(ensonify::tests::torus(40, 20, 15.0, 5.0), 3);
  const ProgressiveMesh mesh = build_by_edge_collapse(source);
  Footprint footprint(mesh);
  Random random(9);
  for (int i = 0; i < 20; ++i) {
    const FanVolume v = random_volume(random, 60.0);
    const ExactFaces exact = footprint.query({&v, 1});
    for (std::size_t f = 0; f < exact.faces.size(); ++f)
      for (std::size_t k = 0; k < 3; ++k)
        CHECK(exact.points[exact.faces[f][k]] ==
              source.positions[source.faces[exact.source_faces[f]][k]]);
    CHECK(std::set(exact.source_faces.begin(), exact.source_faces.end()).size() ==
          exact.faces.size());
  }
}

TEST_CASE("a volume around everything finds all faces, a volume elsewhere none") {
  for (const auto& [name, source] : ensonify::tests::manifold_meshes(false)) {
    INFO(name);
    const ProgressiveMesh mesh = build_by_edge_collapse(source);
    Footprint footprint(mesh);
    FanVolume v = {.apex = {0.0, 0.0, -100.0},
                   .middle = {0.0, 0.0, 1.0},
                   .pole = {0.0, -1.0, 0.0},
                   .truncation_rad = 85.0 * degree,
                   .elevation_low_rad = -85.0 * degree,
                   .elevation_high_rad = 85.0 * degree,
                   .range_m = 1000.0};
    CHECK(footprint.query({&v, 1}).faces.size() == source.faces.size());
    v.range_m = 10.0;
    CHECK(footprint.query({&v, 1}).faces.empty());
    CHECK(footprint.query({}).faces.empty());
    v.range_m = 1000.0;
    v.middle.z() = -1.0;
    CHECK(footprint.query({&v, 1}).faces.empty());
  }
}

TEST_CASE("queries are independent, and a query of several volumes has the faces of each") {
  const TriangleMesh source = ensonify::tests::open_grid(60, 60, 1.0, 1.0, 6);
  const ProgressiveMesh mesh = build_by_edge_collapse(source);
  Footprint one(mesh);
  Random random(10);
  for (int i = 0; i < 20; ++i) {
    const std::vector<FanVolume> volumes = {random_volume(random, 60.0),
                                            random_volume(random, 60.0)};
    Footprint fresh(mesh);
    const std::set<std::uint32_t> both = query(one, volumes);
    CHECK(query(fresh, volumes) == both);
    for (const FanVolume& v : volumes) CHECK(std::ranges::includes(both, query(one, {&v, 1})));
  }
}
