#include <ensonify/refine/active_mesh.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/refine/edge_collapse.h>
#include <ensonify/refine/footprint.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/mesh_repair.h>
#include <ensonify/scatter/angle.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/invariants.h"
#include "support/meshes.h"
#include "support/random_hierarchy.h"

using namespace ensonify::refine;
using ensonify::scatter::degree;
using ensonify::tests::broken_invariants;
using ensonify::tests::NamedMesh;
using ensonify::tests::over_vertices_only;
using ensonify::tests::Random;
using ensonify::tests::random_volume;
using ensonify::tests::uniform;

namespace {

using Lines = std::vector<std::string>;
using Interval = std::pair<std::uint32_t, std::uint32_t>;

struct BuiltHierarchy {
  std::string name;
  TriangleMesh source;
  ProgressiveMesh hierarchy;
};

/// Meshes of every kind with some hundred faces, and the smallest meshes, with good and random
/// hierarchies.
const std::vector<BuiltHierarchy>& small_hierarchies() {
  static const std::vector<BuiltHierarchy> all = [] {
    std::vector<NamedMesh> meshes = ensonify::tests::manifold_meshes(false);
    for (NamedMesh& mesh : ensonify::tests::smallest_meshes()) meshes.push_back(std::move(mesh));
    std::vector<BuiltHierarchy> out;
    for (auto& [name, mesh] : meshes) {
      out.push_back({name, mesh, build_by_edge_collapse(mesh)});
      ProgressiveMeshArrays other = ensonify::tests::random_hierarchy(mesh, 17);
      // Spheres may be too large, and a child's may extend beyond its parent's.
      Random random(18);
      for (Sphere& sphere : other.spheres)
        sphere.radius *= static_cast<float>(uniform(random, 1.0, 3.0));
      out.push_back({name + ", at random", mesh, std::move(other)});
    }
    return out;
  }();
  return all;
}

std::vector<std::uint32_t> splittable(const ActiveMesh& mesh) {
  std::vector<std::uint32_t> out;
  for (std::uint32_t v = 0; v < mesh.nodes().size(); ++v)
    if (mesh.nodes()[v].is_active() && !mesh.nodes()[v].is_leaf()) out.push_back(v);
  return out;
}
std::vector<std::uint32_t> collapsible_nodes(const ActiveMesh& mesh) {
  std::vector<std::uint32_t> out;
  const auto nodes = mesh.nodes();
  for (std::uint32_t v = 0; v < nodes.size(); ++v)
    if (nodes[v].left != ProgressiveMesh::none && nodes[nodes[v].left].is_active() &&
        nodes[nodes[v].left + 1].is_active())
      out.push_back(v);
  return out;
}
std::uint32_t any_of(const std::vector<std::uint32_t>& from, Random& random) {
  return from[random() % from.size()];
}

/// The numbers of the split nodes.
std::set<std::uint32_t> split_numbers(const ActiveMesh& mesh) {
  std::set<std::uint32_t> out;
  for (const ActiveMesh::Node& node : mesh.nodes())
    if (node.left != ProgressiveMesh::none) out.insert(node.number);
  return out;
}
/// How many nodes of `now` other than `number` are not in `before` and not collapsed after
/// `number`.
std::size_t not_later(const ProgressiveMesh& mesh, const std::set<std::uint32_t>& before,
                      const std::set<std::uint32_t>& now, std::uint32_t number) {
  return static_cast<std::size_t>(std::ranges::count_if(now, [&](std::uint32_t n) {
    return n != number && !before.contains(n) && mesh.order[n] <= mesh.order[number];
  }));
}

/// The volume of a sonar that moves along x: looks down, across the track.
FanVolume sonar_volume(double x_m, double y_m, double height_m, double range_m) {
  return {.apex = {x_m, y_m, height_m},
          .array_axis = {1.0, 0.0, 0.0},
          .middle = {0.0, 0.0, -1.0},
          .pole = {0.0, 1.0, 0.0},
          .truncation_rad = 0.5 * degree,
          .elevation_low_rad = -85.0 * degree,
          .elevation_high_rad = 85.0 * degree,
          .range_m = range_m};
}

struct Ray {
  Eigen::Vector3d origin, direction;
};
struct Hit {
  std::uint32_t face = ProgressiveMesh::none;  ///< number in the source
  double t = std::numeric_limits<double>::infinity();
  bool operator==(const Hit&) const = default;
};

/// Moller & Trumbore 1997.
double intersect(const Ray& ray, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                 const Eigen::Vector3d& c) {
  constexpr double miss = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d ab = b - a, ac = c - a, p = ray.direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0.0) return miss;
  const Eigen::Vector3d s = ray.origin - a, q = s.cross(ab);
  const double u = s.dot(p) / determinant, v = ray.direction.dot(q) / determinant;
  const double t = ac.dot(q) / determinant;
  return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 ? t : miss;
}

/// The nearest hit of numbered faces within range; in a tie the lowest number.
template <class Number>
Hit nearest(const Ray& ray, std::span<const Eigen::Vector3f> points, std::span<const Face> faces,
            double range_m, Number number) {
  Hit best;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto corner = [&](std::size_t k) { return points[faces[f][k]].cast<double>().eval(); };
    const double t = intersect(ray, corner(0), corner(1), corner(2));
    if (t <= range_m && (t < best.t || (t == best.t && number(f) < best.face)))
      best = {number(f), t};
  }
  return best;
}
Hit nearest(const Ray& ray, const TriangleMesh& mesh, double range_m) {
  return nearest(ray, mesh.positions, mesh.faces, range_m,
                 [](std::size_t f) { return static_cast<std::uint32_t>(f); });
}
Hit nearest(const Ray& ray, const ExactFaces& exact, double range_m) {
  return nearest(ray, exact.points, exact.faces, range_m,
                 [&](std::size_t f) { return exact.source_faces[f]; });
}

/// A fan near the mesh, aimed at one of its vertices.
FanVolume aimed_volume(const TriangleMesh& mesh, double size_m, Random& random) {
  FanVolume v = random_volume(random, size_m);
  const double distance = uniform(random, 0.02, 0.2) * size_m;
  v.apex = mesh.positions[random() % mesh.positions.size()].cast<double>() - distance * v.middle;
  return v;
}

/// A ray of the fan, sometimes on its edge.
Ray random_ray(const FanVolume& v, Random& random) {
  const double edge = uniform(random);
  const double elevation = edge < 0.1 ? v.elevation_low_rad
                           : edge < 0.2
                               ? v.elevation_high_rad
                               : uniform(random, v.elevation_low_rad, v.elevation_high_rad);
  const double reach = std::min(1.0, std::sin(v.truncation_rad) / std::cos(elevation));
  const double turn = std::asin(reach) * (edge < 0.6   ? uniform(random, -1.0, 1.0)
                                          : edge < 0.8 ? -1.0
                                                       : 1.0);
  return {v.apex,
          std::sin(elevation) * v.pole +
              std::cos(elevation) * (std::cos(turn) * v.middle + std::sin(turn) * v.array_axis)};
}

struct Agreement {
  std::size_t hits = 0, wrong = 0;
};
/// Random rays of random fans: compares the nearest of the exact faces with the nearest of all.
/// From the second half on, the fan's range is exactly one hit's distance.
Agreement agreement(const TriangleMesh& source, const ProgressiveMesh& hierarchy, double size_m,
                    int volumes, int rays) {
  Random random(21);
  ActiveMesh mesh(hierarchy);
  Agreement out;
  for (int i = 0; i < volumes; ++i) {
    FanVolume v = aimed_volume(source, size_m, random);
    for (int j = 0; j < rays; ++j) {
      const Ray ray = random_ray(v, random);
      const Hit hit = nearest(ray, source, v.range_m);
      if (j == rays / 2 && hit.face != ProgressiveMesh::none) v.range_m = hit.t;
      if (j == 0 || j == rays / 2) mesh.refine({&v, 1});
      out.hits += hit.face != ProgressiveMesh::none;
      out.wrong += nearest(ray, mesh.exact_faces(), v.range_m) != hit;
    }
  }
  return out;
}

std::set<Interval> intervals(const ActiveMesh& mesh) {
  std::set<Interval> out;
  for (const ActiveMesh::Node& node : mesh.nodes())
    if (node.is_active()) out.insert({node.lo, node.hi});
  return out;
}

}  // namespace

TEST_CASE("an active mesh starts as the base mesh and keeps its laws through random changes") {
  std::size_t blocked = 0, collapsed = 0, forced = 0, unblocked = 0;
  for (const auto& [name, source, hierarchy] : small_hierarchies()) {
    INFO(name);
    ActiveMesh mesh(hierarchy);
    CHECK(mesh.vertex_count() == hierarchy.roots.size());
    CHECK(mesh.face_count() == hierarchy.base_faces().size());
    CHECK(broken_invariants(mesh) == Lines{});
    Random random(31);
    std::size_t earlier = 0;
    for (int step = 0; step < 2000; ++step) {
      // Alternately finer and coarser.
      const bool finer = uniform(random) < (step / 200 % 2 == 0 ? 0.7 : 0.3);
      const auto from = finer ? splittable(mesh) : collapsible_nodes(mesh);
      if (from.empty()) continue;
      const std::uint32_t at = any_of(from, random), number = mesh.nodes()[at].number;
      const auto before = split_numbers(mesh);
      if (finer) {
        mesh.vsplit(at);
        const auto now = split_numbers(mesh);
        CHECK(now.contains(number));
        forced += now.size() - before.size() - 1;
        earlier += not_later(hierarchy, before, now, number);
      } else if (mesh.ecol(at)) {
        const auto now = split_numbers(mesh);
        CHECK(!now.contains(number));
        ++collapsed;
        unblocked += now.size() + 1 - before.size();
        earlier += not_later(hierarchy, before, now, number);
      } else {
        ++blocked;
        CHECK(split_numbers(mesh) == before);
      }
      if (step % 25 == 0) REQUIRE(broken_invariants(mesh) == Lines{});
    }
    REQUIRE(broken_invariants(mesh) == Lines{});
    CHECK(earlier == 0);
  }
  CHECK(collapsed > 5000);
  CHECK(forced > 100);
  CHECK(unblocked > 0);
  CHECK(blocked > 10);
}

TEST_CASE("full refinement gives back every face, and full coarsening in any order the base mesh") {
  for (const auto& [name, source, hierarchy] : small_hierarchies()) {
    INFO(name);
    ActiveMesh mesh(hierarchy);
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      Random random(seed);
      for (auto from = splittable(mesh); !from.empty(); from = splittable(mesh))
        mesh.vsplit(any_of(from, random));
      CHECK(broken_invariants(mesh) == Lines{});
      CHECK(mesh.vertex_count() == source.positions.size());
      CHECK(ensonify::tests::has_all_faces(mesh, source));

      for (auto from = collapsible_nodes(mesh); !from.empty(); from = collapsible_nodes(mesh)) {
        bool moved = false;
        while (!from.empty() && !moved) {
          const std::size_t i = random() % from.size();
          moved = mesh.ecol(from[i]);
          from.erase(from.begin() + static_cast<std::ptrdiff_t>(i));
        }
        REQUIRE(moved);
      }
      CHECK(broken_invariants(mesh) == Lines{});
      CHECK(mesh.vertex_count() == hierarchy.roots.size());
      CHECK(mesh.face_count() == hierarchy.base_faces().size());
    }
  }
}

TEST_CASE("a split and its collapse undo one another") {
  for (const auto& [name, source, hierarchy] : small_hierarchies()) {
    INFO(name);
    ActiveMesh mesh(hierarchy);
    Random random(41);
    int undone = 0, redone = 0;
    for (int step = 0; step < 600; ++step) {
      const auto from = splittable(mesh);
      if (from.empty()) {
        mesh.reset();
        continue;
      }
      const std::uint32_t v = any_of(from, random);
      const auto before = intervals(mesh);
      mesh.vsplit(v);
      if (mesh.vertex_count() != before.size() + 1) continue;  // other splits were forced
      const auto split = intervals(mesh);
      REQUIRE(mesh.ecol(v));
      CHECK(intervals(mesh) == before);
      ++undone;
      if (step % 20 == 0) CHECK(broken_invariants(mesh) == Lines{});
      mesh.vsplit(v);
      CHECK(intervals(mesh) == split);
      ++redone;
      if (step % 20 == 10) CHECK(broken_invariants(mesh) == Lines{});
    }
    if (source.faces.size() < 100) continue;
    CHECK(undone > 100);
    CHECK(redone > 100);
  }
}

TEST_CASE("refinement keeps all laws and has all that any of its volumes can touch") {
  std::size_t exact = 0, forced = 0, unblocking = 0;
  for (const auto& [name, source, hierarchy] : small_hierarchies()) {
    INFO(name);
    ActiveMesh mesh(hierarchy);
    Footprint footprint(hierarchy);
    Random random(51);
    for (int ping = 0; ping < 40; ++ping) {
      std::vector<FanVolume> volumes;
      for (std::uint64_t n = random() % 4; n > 0; --n)
        volumes.push_back(random_volume(random, 60.0));
      const std::size_t before = mesh.vertex_count();
      const RefineStatistics s = mesh.refine(volumes);
      CHECK(mesh.vertex_count() == before + s.splits - s.collapses);
      REQUIRE(broken_invariants(mesh, volumes) == Lines{});
      // The same for each sonar alone.
      const auto kept = mesh.exact_faces().source_faces;
      for (const FanVolume& v : volumes)
        for (const std::uint32_t f : footprint.query({&v, 1}).source_faces)
          CHECK(std::ranges::binary_search(kept, f));
      exact += kept.size();
      forced += s.forced_splits;
      unblocking += s.unblocking_splits;
    }
    mesh.refine({});
    CHECK(broken_invariants(mesh) == Lines{});
    CHECK(mesh.vertex_count() == hierarchy.roots.size());
    CHECK(mesh.face_count() == hierarchy.base_faces().size());
  }
  CHECK(exact > 1000);
  CHECK(forced > 10);
  CHECK(unblocking > 0);
}

TEST_CASE("every ray of a fan hits the exact faces as it hits the whole mesh") {
  for (const auto& [name, source] : ensonify::tests::manifold_meshes()) {
    INFO(name);
    const ProgressiveMesh hierarchy = build_by_edge_collapse(source);
    const Agreement good = agreement(source, hierarchy, 60.0, 100, 10);
    CHECK(good.hits > 100);
    CHECK(good.wrong == 0);
  }
}

TEST_CASE("spheres around the vertices alone would lose hits") {
  for (const auto& [name, source] : ensonify::tests::manifold_meshes()) {
    INFO(name);
    const ProgressiveMesh hierarchy = build_by_edge_collapse(source);
    const Agreement lost = agreement(source, over_vertices_only(hierarchy), 60.0, 50, 10);
    CHECK(lost.wrong > lost.hits / 50);
  }
}

TEST_CASE("giving out coarse faces too would change hits") {
  std::size_t wrong = 0;
  for (const auto& [name, source, hierarchy] : small_hierarchies()) {
    if (hierarchy.mid.empty()) continue;
    Random random(61);
    ActiveMesh mesh(hierarchy);
    for (int i = 0; i < 1000; ++i) {
      // A narrow fan through a coarse face, which mostly disappears then.
      FanVolume v = random_volume(random, 60.0);
      const ActiveMesh::ActiveFace& aim = mesh.faces()[random() % mesh.faces().size()];
      if (aim.slot == ProgressiveMesh::none) continue;
      v.apex = -uniform(random, 0.1, 20.0) * v.middle;
      for (const std::uint32_t corner : aim.vertices)
        v.apex += mesh.position(corner).cast<double>() / 3.0;
      v.truncation_rad = v.elevation_high_rad = 1e-4;
      v.elevation_low_rad = -1e-4;
      mesh.refine({&v, 1});
      const Ray ray = {v.apex, v.middle};
      Hit coarse;
      for (const ActiveMesh::ActiveFace& face : mesh.faces()) {
        if (face.slot == ProgressiveMesh::none) continue;
        const auto corner = [&](std::size_t k) {
          return mesh.position(face.vertices[k]).cast<double>().eval();
        };
        const double t = intersect(ray, corner(0), corner(1), corner(2));
        if (t < coarse.t && t <= v.range_m) coarse = {hierarchy.source_face[face.slot], t};
      }
      const Hit hit = nearest(ray, source, v.range_m);
      wrong += coarse != hit;
      CHECK(nearest(ray, mesh.exact_faces(), v.range_m) == hit);
    }
  }
  CHECK(wrong > 0);
}

TEST_CASE("children of a forced split that are not tested again would be missing") {
  const ProgressiveMesh hierarchy =
      build_by_edge_collapse(ensonify::tests::open_grid(50, 50, 1.0, 1.0, 6));
  Random random(71);
  std::size_t broken = 0;
  for (int i = 0; i < 100; ++i) {
    const FanVolume v = random_volume(random, 60.0);
    const ViewTest view({&v, 1});
    const auto touched = [&](const ActiveMesh& mesh, std::uint32_t at) {
      const ActiveMesh::Node& node = mesh.nodes()[at];
      return node.is_active() && !node.is_leaf() && view.touches(hierarchy.spheres[node.number]);
    };
    // A refinement that continues only with the children of touched splits, not of forced ones.
    ActiveMesh mesh(hierarchy);
    std::vector<std::uint32_t> pending;
    for (std::uint32_t at = 0; at < mesh.nodes().size(); ++at) pending.push_back(at);
    for (std::size_t next = 0; next < pending.size(); ++next) {
      if (!touched(mesh, pending[next])) continue;
      mesh.vsplit(pending[next]);
      const std::uint32_t left = mesh.nodes()[pending[next]].left;
      pending.insert(pending.end(), {left, left + 1});
    }
    CHECK(broken_invariants(mesh) == Lines{});
    broken += !broken_invariants(mesh, {&v, 1}).empty();
  }
  CHECK(broken > 0);
}

TEST_CASE("real meshes keep the same laws, and rays hit them as the whole mesh") {
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
  const ProgressiveMesh hierarchy = build_by_edge_collapse(source);
  ActiveMesh mesh(hierarchy);
  Random random(81);
  for (int ping = 0; ping < 10; ++ping) {
    const std::vector<FanVolume> volumes = {random_volume(random, size_m),
                                            random_volume(random, size_m)};
    mesh.refine(volumes);
    if (ping % 3 == 0) REQUIRE(broken_invariants(mesh, volumes) == Lines{});
  }
  mesh.refine({});
  CHECK(broken_invariants(mesh) == Lines{});
  CHECK(mesh.vertex_count() == hierarchy.roots.size());
  const Agreement good = agreement(source, hierarchy, size_m, 40, 4);
  CHECK(good.hits > 50);
  CHECK(good.wrong == 0);
}

TEST_CASE("after a thousand pings the mesh has hardly more than the last ping needs") {
  const ProgressiveMesh hierarchy =
      build_by_edge_collapse(ensonify::tests::open_grid(180, 120, 0.3, 0.2, 7));
  ActiveMesh mesh(hierarchy), fresh(hierarchy);
  std::size_t unblocking = 0, splits = 0;
  for (int ping = 0; ping <= 1000; ++ping) {
    const FanVolume v = sonar_volume(-24.0 + 0.048 * ping, 0.2 * std::sin(0.01 * ping), 5.0, 15.0);
    const RefineStatistics s = mesh.refine({&v, 1});
    splits += s.splits;
    unblocking += s.unblocking_splits;
    if (ping % 250 != 0) continue;
    fresh.reset();
    fresh.refine({&v, 1});
    CHECK(fresh.vertex_count() > 100);
    CHECK(mesh.vertex_count() <= 1.05 * fresh.vertex_count());
    CHECK(broken_invariants(mesh, {&v, 1}) == Lines{});
  }
  CHECK(unblocking > 0);
  CHECK(unblocking < splits / 100);
}

TEST_CASE("a reset removes every trace, and the same pings give the same faces") {
  const ProgressiveMesh hierarchy =
      build_by_edge_collapse(ensonify::tests::open_grid(40, 40, 1.0, 1.0, 8));
  ActiveMesh one(hierarchy), other(hierarchy);
  Random random(91);
  for (int i = 0; i < 30; ++i) {
    const FanVolume v = random_volume(random, 50.0);
    other.refine({&v, 1});
  }
  other.reset();
  CHECK(other.exact_faces().faces.empty());
  CHECK(broken_invariants(other) == Lines{});
  for (int i = 0; i < 30; ++i) {
    const FanVolume v = random_volume(random, 50.0);
    const RefineStatistics a = one.refine({&v, 1}), b = other.refine({&v, 1});
    CHECK(a.splits == b.splits);
    CHECK(a.collapses == b.collapses);
    CHECK(intervals(one) == intervals(other));
    CHECK(std::ranges::equal(one.exact_faces().source_faces, other.exact_faces().source_faces));
    CHECK(std::ranges::equal(one.exact_faces().faces, other.exact_faces().faces));
  }
}

TEST_CASE("the same volume changes nothing the second time") {
  const ProgressiveMesh hierarchy =
      build_by_edge_collapse(ensonify::tests::open_grid(60, 60, 1.0, 1.0, 9));
  ActiveMesh mesh(hierarchy);
  Random random(101);
  for (int i = 0; i < 10; ++i) {
    const FanVolume v = random_volume(random, 60.0);
    mesh.refine({&v, 1});
    mesh.refine({&v, 1});
    const RefineStatistics s = mesh.refine({&v, 1});
    CHECK(s.splits == 0);
    CHECK(s.collapses == 0);
  }
}

TEST_CASE("invalid splits and collapses are refused") {
  const ProgressiveMesh hierarchy =
      build_by_edge_collapse(ensonify::tests::open_grid(5, 5, 1.0, 1.0, 1));
  ActiveMesh mesh(hierarchy);
  const std::uint32_t root = splittable(mesh).front();
  CHECK_THROWS_AS(mesh.ecol(root), std::invalid_argument);
  CHECK_THROWS_AS(mesh.vsplit(1000), std::invalid_argument);
  CHECK_THROWS_AS(mesh.ecol(1000), std::invalid_argument);
  mesh.vsplit(root);
  CHECK_THROWS_AS(mesh.vsplit(root), std::invalid_argument);
  const FanVolume v = {.range_m = -1.0};
  CHECK_THROWS_AS(mesh.refine({&v, 1}), std::invalid_argument);
  CHECK(broken_invariants(mesh) == Lines{});
}
