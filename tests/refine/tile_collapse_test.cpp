#include <ensonify/refine/tile_collapse.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <ensonify/refine/active_mesh.h>
#include <ensonify/refine/edge_collapse.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/mesh_repair.h>
#include <ensonify/scatter/angle.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/invariants.h"
#include "support/manifold.h"
#include "support/meshes.h"
#include "support/topology.h"

using namespace ensonify::refine;
using Catch::Contains;
using ensonify::scatter::degree;
using ensonify::tests::broken_invariants;
using ensonify::tests::manifold_fault;
using ensonify::tests::NamedMesh;
using ensonify::tests::Random;
using ensonify::tests::random_volume;
using ensonify::tests::same_bytes;
using ensonify::tests::topology;
using ensonify::tests::uniform;

namespace {

using Lines = std::vector<std::string>;

/// Meshes of every kind, large enough for several tiles, and the smallest possible ones.
const std::vector<NamedMesh>& meshes() {
  static const std::vector<NamedMesh> all = [] {
    using namespace ensonify::tests;
    std::vector<NamedMesh> out = manifold_meshes(false);
    for (NamedMesh& mesh : manifold_meshes(true)) out.push_back(std::move(mesh));
    out.push_back({"wide grid", shuffled(open_grid(300, 80, 0.2, 0.3, 21), 31)});
    out.push_back({"wide grid with holes", holed_grid(120, 0.3, 0.3, 22)});
    out.push_back({"wide overhang", shuffled(overhang(100, 100, 0.4, 23), 33)});
    out.push_back({"large torus", torus(200, 60, 15.0, 5.0)});
    out.push_back({"large ball", shuffled(ball(6, 15.0), 34)});
    TriangleMesh scattered = open_grid(80, 80, 0.5, 0.5, 24);  // uneven, with much small detail
    Random random(25);
    for (int i = 0; i < 60; ++i)
      join(scattered, i % 3 == 0 ? torus(12, 8, 1.0, 0.3) : ball(2, 0.7),
           (15.0 * direction(random)).cast<float>());
    out.push_back({"many components", shuffled(scattered, 35)});
    for (NamedMesh& mesh : smallest_meshes()) out.push_back(std::move(mesh));
    out.push_back({"one face among lone vertices", random_vertices({{4, 1, 2}}, 5000)});
    return out;
  }();
  return all;
}

/// The base mesh's faces, by root.
std::vector<Face> base_of(const ProgressiveMesh& mesh) {
  std::vector<Face> out(mesh.base_faces().begin(), mesh.base_faces().end());
  for (Face& face : out)
    for (std::uint32_t& v : face)
      v = static_cast<std::uint32_t>(std::ranges::upper_bound(mesh.roots, v) - mesh.roots.begin() -
                                     1);
  return out;
}

/// All laws at random refinements, at full refinement and back at the base.
void check_refinement(const TriangleMesh& source, const ProgressiveMesh& hierarchy, double size_m,
                      int pings) {
  CHECK(broken_invariants(hierarchy) == Lines{});
  ActiveMesh mesh(hierarchy);
  CHECK(broken_invariants(mesh) == Lines{});
  Random random(41);
  for (int ping = 0; ping < pings; ++ping) {
    const std::vector<FanVolume> volumes = {random_volume(random, size_m),
                                            random_volume(random, size_m)};
    mesh.refine(volumes);
    REQUIRE(broken_invariants(mesh, volumes) == Lines{});
  }
  // Finer and coarser, in random order.
  std::vector<std::uint32_t> inner;
  for (bool moved = true; moved;) {
    inner.clear();
    for (std::uint32_t v = 0; v < mesh.nodes().size(); ++v)
      if (mesh.nodes()[v].is_active() && !mesh.nodes()[v].is_leaf()) inner.push_back(v);
    moved = !inner.empty();
    for (std::size_t i = inner.size(); i > 1; --i) std::swap(inner[i - 1], inner[random() % i]);
    for (const std::uint32_t v : inner)
      if (mesh.nodes()[v].is_active() && !mesh.nodes()[v].is_leaf()) mesh.vsplit(v);
  }
  CHECK(broken_invariants(mesh) == Lines{});
  CHECK(mesh.vertex_count() == source.positions.size());
  CHECK(ensonify::tests::has_all_faces(mesh, source));
  mesh.refine({});
  CHECK(broken_invariants(mesh) == Lines{});
  CHECK(mesh.vertex_count() == hierarchy.roots.size());
  CHECK(mesh.face_count() == hierarchy.base_faces().size());
}

}  // namespace

TEST_CASE("the base mesh of tiles has the mesh's topology, and nothing in it can be collapsed") {
  for (const auto& [name, source] : meshes()) {
    INFO(name);
    const ProgressiveMesh mesh = build_by_tiles(source, 2);
    const std::vector<Face> base = base_of(mesh);
    CHECK(topology(base).kept() == topology(source.faces).kept());
    if (!base.empty()) CHECK(manifold_fault(base) == "");
    std::set<std::set<std::uint32_t>> corners;  // no two faces coincide
    for (const Face& face : base) corners.emplace(face.begin(), face.end());
    CHECK(corners.size() == base.size());
    // The reference builder finds nothing more to collapse.
    TriangleMesh again{.faces = base};
    again.positions.resize(mesh.roots.size(), Eigen::Vector3f::Zero());
    CHECK(build_by_edge_collapse(again).mid.empty());
    CHECK(mesh.leaves() == source.positions.size());
  }
}

TEST_CASE("the base vertices that tiles leave of a bed are on its outline") {
  const ProgressiveMesh mesh = build_by_tiles(ensonify::tests::open_grid(120, 90, 1.0, 0.5, 1), 1);
  for (std::size_t root = 0; root < mesh.roots.size(); ++root) {
    const Eigen::Vector3f& kept = mesh.points[mesh.end_of(root) - 1];
    CHECK((std::abs(kept.x()) == 59.5f || std::abs(kept.y()) == 44.5f));
  }
}

TEST_CASE(
    "refinement of a mesh built by tiles keeps all laws, and spheres hold their closed stars") {
  for (const auto& [name, source] : meshes()) {
    INFO(name);
    const int pings = source.faces.size() > 3000 ? 4 : 20;
    check_refinement(source, build_by_tiles(source, 2), 60.0, pings);
    check_refinement(source, build_by_tiles(source, 2, Borders::stay), 60.0, pings);
  }
}

TEST_CASE("the work by tiles is ended by what its check throws") {
  const TriangleMesh mesh = ensonify::tests::open_grid(200, 200, 0.5, 0.5, 1);
  int calls = 0;
  build_by_tiles(mesh, 1, Borders::collapse, [&] { ++calls; });
  CHECK(calls > 5);
  const auto stop = [] { throw std::runtime_error("stopped"); };
  CHECK_THROWS_WITH(build_of_any_mesh(mesh, 2, Borders::collapse, stop), Contains("stopped"));
}

TEST_CASE("any number of threads builds the same bytes by tiles") {
  for (const auto& [name, source] : meshes()) {
    INFO(name);
    const ProgressiveMeshArrays one = build_by_tiles(source, 1);
    CHECK(same_bytes(one, build_by_tiles(source, 2)));
    CHECK(same_bytes(one, build_by_tiles(source, 4)));
    ProgressiveMeshArrays other = one;
    if (other.mid.empty()) continue;
    other.spheres.back().radius = std::nextafter(other.spheres.back().radius, 0.0f);
    CHECK_FALSE(same_bytes(one, other));
  }
}

TEST_CASE(
    "trees of many tiles are as balanced as the reference builder's, and force no more splits") {
  const TriangleMesh source = ensonify::tests::open_grid(300, 300, 0.2, 0.1, 51);
  const auto measure = [&](const ProgressiveMesh& hierarchy) {
    struct {
      double depth = 0.0;  // mean depth of a leaf
      std::size_t splits = 0, forced = 0, blocked = 0;
    } out;
    ensonify::tests::for_each_node(hierarchy, [&](auto, auto lo, auto, auto hi, auto) {
      out.depth += static_cast<double>(hi - lo) / hierarchy.leaves();
    });
    ActiveMesh mesh(hierarchy);
    for (int ping = 0; ping < 300; ++ping) {
      const FanVolume v = {.apex = {-30.0 + 0.2 * ping, 0.0, 4.0},
                           .array_axis = {1.0, 0.0, 0.0},
                           .middle = {0.0, 0.0, -1.0},
                           .pole = {0.0, 1.0, 0.0},
                           .truncation_rad = 0.5 * degree,
                           .elevation_low_rad = -85.0 * degree,
                           .elevation_high_rad = 85.0 * degree,
                           .range_m = 25.0};
      const RefineStatistics s = mesh.refine({&v, 1});
      out.splits += s.splits;
      out.forced += s.forced_splits;
      out.blocked += s.blocked_collapses;
    }
    return out;
  };
  const auto tiles = measure(build_by_tiles(source, 2));
  const auto reference = measure(build_by_edge_collapse(source));
  CHECK(tiles.depth < std::log2(source.positions.size()) + 1.0);
  CHECK(tiles.splits < 1.02 * reference.splits);
  CHECK(tiles.forced < reference.forced);
  CHECK(tiles.blocked < reference.blocked);
}

TEST_CASE("real meshes can be built by tiles, the wreck on a bed too") {
  const auto file = GENERATE(as<std::string>(), "mesh_underwater/skytteren_wreck.ply",
                             "mesh_underwater/coral_mcap.ply", "mesh_underwater/large_rock.stl",
                             "bathymetry/ncei19_nantucket_a.obj");
  const auto path = ensonify::tests::data_file(file);
  if (!path) {
    WARN("skipped: " << file << " is missing");
    return;
  }
  INFO(file);
  TriangleMesh source = repair(read_mesh(*path)).mesh;
  Bounds box = bounds(source);
  if (file.find("wreck") != std::string::npos) {
    const double cell_m = (box.highest - box.lowest).norm() / 100.0;
    ensonify::tests::join(source, ensonify::tests::open_grid(150, 150, cell_m, cell_m, 61),
                          0.5f * (box.lowest + box.highest));
    box = bounds(source);
  }
  const ProgressiveMesh hierarchy = build_by_tiles(source, 2);
  CHECK(same_bytes(hierarchy, build_by_tiles(source, 1)));
  CHECK(topology(base_of(hierarchy)).kept() == topology(source.faces).kept());
  check_refinement(source, hierarchy, (box.highest - box.lowest).norm(), 4);
}

TEST_CASE("a vertex shared by very many faces costs no more than others") {
  constexpr std::uint32_t n = 100'000;
  TriangleMesh source;
  source.positions.emplace_back(0.0f, 0.0f, 1.0f);
  for (std::uint32_t v = 0; v < n; ++v) {
    const double angle = 2.0 * std::numbers::pi * v / n;
    source.positions.emplace_back(
        Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0).cast<float>());
    source.faces.push_back({0, v + 1, (v + 1) % n + 1});
  }
  const ProgressiveMesh mesh = build_by_tiles(ensonify::tests::shuffled(source, 71), 2);
  CHECK(topology(base_of(mesh)).kept() == topology(source.faces).kept());
  CHECK(broken_invariants(mesh) == Lines{});
}

TEST_CASE("meshes that are not manifold, oriented and finite are refused with the reason") {
  struct Case {
    std::vector<Face> faces;
    const char* message;
  };
  const std::vector<Face> tetrahedron = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  std::vector<Face> two = tetrahedron;  // two that meet at vertex 0
  for (const Face& f : tetrahedron)
    two.push_back({f[0] ? f[0] + 3 : 0, f[1] ? f[1] + 3 : 0, f[2] ? f[2] + 3 : 0});
  const std::vector<Case> cases = {
      {{{0, 1, 2}, {0, 2, 10}}, "face 1 of the mesh names vertex 10, which does not exist"},
      {{{0, 1, 1}}, "face 0 of the mesh has vertex 1 twice"},
      {{{0, 1, 2}, {0, 1, 3}},
       "face 1 of the mesh shares the edge of vertices 0 and 1 with face 0"},
      {{{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}, "shares the edge of vertices"},
      {{{0, 1, 2}, {0, 3, 4}}, "of the mesh meets others at vertex 0"},
      {two, "of the mesh meets others at vertex 0"},
      {{{0, 1, 9}}, "face 0 of the mesh names vertex 9, whose position is not finite"}};
  for (const Case& c : cases) {
    TriangleMesh mesh{.faces = c.faces};
    for (int i = 0; i < 10; ++i) mesh.positions.emplace_back(Eigen::Vector3f::Random());
    mesh.positions.back().x() = std::numeric_limits<float>::quiet_NaN();
    CHECK_THROWS_WITH(build_by_tiles(mesh, 1),
                      Contains(c.message) && Contains("repair the mesh first"));
    CHECK_THROWS_AS(build_by_tiles(mesh, 2), MeshError);
  }
  CHECK_THROWS_AS(build_by_tiles(ensonify::tests::open_grid(3, 3, 1.0, 0.0, 1), 0),
                  std::invalid_argument);
  CHECK_THROWS_AS(build_by_tiles({}, 0), std::invalid_argument);
}
