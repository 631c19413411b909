#include <ensonify/refine/edge_collapse.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <map>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/mesh_repair.h>

#include "support/catch.h"
#include "support/data.h"
#include "support/manifold.h"
#include "support/meshes.h"
#include "support/topology.h"

using namespace ensonify::refine;
using Catch::Contains;
using ensonify::tests::for_each_node;
using ensonify::tests::manifold_fault;
using ensonify::tests::Topology;
using ensonify::tests::topology;

namespace {

/// Faces with any vertex numbers.
using Faces = std::vector<Face>;

/// Edges whose ends have no common neighbours except across their faces, and which are not a chord
/// between borders: edges that could still be collapsed.
std::size_t collapsible_edges(std::span<const Face> faces) {
  std::map<std::uint32_t, std::set<std::uint32_t>> ring;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> across;
  for (const Face& f : faces)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = f[k], b = f[(k + 1) % 3];
      ring[a].insert(b);
      ring[b].insert(a);
      across[{a, b}] = f[(k + 2) % 3];
    }
  std::set<std::uint32_t> on_border;
  for (const auto& [edge, corner] : across)
    if (!across.contains({edge.second, edge.first})) on_border.insert({edge.first, edge.second});
  std::size_t count = 0;
  for (const auto& [edge, corner] : across) {
    const auto [a, b] = edge;
    const bool border = !across.contains({b, a});
    if (!border && (a > b || (on_border.contains(a) && on_border.contains(b)))) continue;
    std::set<std::uint32_t> common, expected = {corner};
    std::ranges::set_intersection(ring[a], ring[b], std::inserter(common, common.end()));
    if (!border) expected.insert(across[{b, a}]);
    // A lone triangle, or one connected by one edge, would vanish without a trace; a tetrahedron
    // would become two coincident faces.
    const auto loose = [&](std::uint32_t c, std::uint32_t from, std::uint32_t to) {
      return !across.contains({c, to}) && !across.contains({from, c});
    };
    const bool hangs = loose(corner, a, b) || (!border && loose(across[{b, a}], b, a));
    const bool tetrahedron = !border && across.contains({corner, across[{b, a}]}) &&
                             ring[a].size() == 3 && ring[b].size() == 3;
    count += common == expected && !hangs && !tetrahedron;
  }
  return count;
}

/// The corners' representatives after the first `collapses` collapses.
class Replay {
 public:
  explicit Replay(const ProgressiveMesh& mesh) : mesh_(mesh), stand_in_(mesh.leaves()) {
    for (std::uint32_t leaf = 0; leaf < mesh.leaves(); ++leaf) stand_in_[leaf] = leaf;
    nodes_.resize(mesh.mid.size());
    for_each_node(mesh, [&](auto node, auto lo, auto mid, auto hi, auto) {
      nodes_[mesh.order[node]] = {node, lo, mid, hi};
    });
  }
  struct Node {
    std::uint32_t node, lo, mid, hi;
  };
  Node collapse(std::size_t c) {
    const Node& node = nodes_[c];
    std::fill(stand_in_.begin() + node.mid, stand_in_.begin() + node.hi, stand_in_[node.lo]);
    return node;
  }
  /// The faces with three distinct representatives.
  Faces faces() const {
    Faces out;
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f)
      if (mesh_.source_face[f] != ProgressiveMesh::none) {
        const Face s = stand_ins(f);
        if (s[0] != s[1] && s[1] != s[2] && s[2] != s[0]) out.push_back(s);
      }
    return out;
  }
  Face stand_ins(std::size_t slot) const {
    const Face& f = mesh_.faces[slot];
    return {stand_in_[f[0]], stand_in_[f[1]], stand_in_[f[2]]};
  }

 private:
  const ProgressiveMesh& mesh_;
  std::vector<std::uint32_t> stand_in_;
  std::vector<Node> nodes_;
};

void check_build(const TriangleMesh& source, std::size_t looks) {
  const ProgressiveMesh mesh = build_by_edge_collapse(source);
  const Topology before = topology(source.faces);
  const std::size_t unused = source.positions.size() - before.vertices;

  Replay replay(mesh);
  const std::size_t collapses = mesh.order.size(),
                    step = std::max<std::size_t>(1, collapses / looks);
  for (std::size_t c = 0; c < collapses; ++c) {
    replay.collapse(c);
    if (c % step) continue;
    const Faces faces = replay.faces();
    CHECK(manifold_fault(faces) == "");
    CHECK(topology(faces).euler() == before.euler());
  }
  // The base mesh is left: nothing else vanished, and nothing more can.
  CHECK(replay.faces().size() == mesh.base_faces().size());
  const Topology after = topology(replay.faces());
  CHECK(after.vertices + unused == mesh.roots.size());
  CHECK(after.kept() == before.kept());
  CHECK(collapsible_edges(replay.faces()) == 0);
}

}  // namespace

TEST_CASE("collapses keep a manifold mesh's topology, down to a base that allows no more") {
  for (const auto& [name, mesh] : ensonify::tests::manifold_meshes(false)) {
    INFO(name);
    check_build(mesh, 20);
  }
}

TEST_CASE("real meshes collapse to a base of the same topology") {
  const auto file = GENERATE(as<std::string>(), "mesh_underwater/skytteren_wreck.ply",
                             "mesh_underwater/large_rock.stl", "mesh_underwater/coral_mcap.ply");
  const auto path = ensonify::tests::data_file(file);
  if (!path) {
    WARN("skipped: " << file << " is missing");
    return;
  }
  INFO(file);
  check_build(repair(read_mesh(*path)).mesh, 4);
}

TEST_CASE("each collapse removes its node's faces and no others") {
  for (const auto& [name, source] : ensonify::tests::manifold_meshes(false)) {
    INFO(name);
    const ProgressiveMesh mesh = build_by_edge_collapse(source);
    Replay replay(mesh);
    std::size_t left = replay.faces().size(), wrong = 0;
    for (std::size_t c = 0; c < mesh.order.size(); ++c) {
      const std::uint32_t node = replay.collapse(c).node;
      for (const std::size_t slot : {2 * std::size_t{node}, 2 * std::size_t{node} + 1})
        if (mesh.source_face[slot] != ProgressiveMesh::none) {
          const Face s = replay.stand_ins(slot);
          wrong += std::set(s.begin(), s.end()).size() != 2;
          --left;
        }
      wrong += replay.faces().size() != left;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("the same mesh gives the same hierarchy") {
  const TriangleMesh source = ensonify::tests::open_grid(30, 30, 1.0, 0.5, 9);
  const ProgressiveMeshArrays a = build_by_edge_collapse(source),
                              b = build_by_edge_collapse(source);
  CHECK(a.mid == b.mid);
  CHECK(a.order == b.order);
  CHECK(a.source_face == b.source_face);
}

TEST_CASE("a level bed's trees are balanced, although all its collapses cost the same") {
  const ProgressiveMesh mesh =
      build_by_edge_collapse(ensonify::tests::open_grid(65, 65, 1.0, 0.0, 1));
  double leaf_depths = 0.0;  // a leaf's depth is the number of nodes above it
  for_each_node(mesh, [&](auto, auto lo, auto, auto hi, auto) { leaf_depths += hi - lo; });
  CHECK(leaf_depths / mesh.leaves() < std::log2(mesh.leaves()) + 2.0);
}

TEST_CASE("a vertex that no face uses is a separate root") {
  TriangleMesh source = ensonify::tests::open_grid(5, 5, 1.0, 0.0, 1);
  const std::size_t roots = build_by_edge_collapse(source).roots.size();
  source.positions.insert(source.positions.begin() + 3, Eigen::Vector3f(1.0f, 2.0f, 3.0f));
  for (Face& face : source.faces)
    for (std::uint32_t& v : face) v += v >= 3;
  CHECK(build_by_edge_collapse(source).roots.size() == roots + 1);
  CHECK(build_by_edge_collapse({}).roots.empty());
}

TEST_CASE(
    "meshes that half-edges cannot hold are refused with the reason, and nothing is printed") {
  struct Case {
    Faces faces;
    const char* message;
  };
  const Faces tetrahedron = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  Faces two = tetrahedron;  // two that meet at vertex 0
  for (const Face& f : tetrahedron)
    two.push_back({f[0] ? f[0] + 3 : 0, f[1] ? f[1] + 3 : 0, f[2] ? f[2] + 3 : 0});
  Faces mingled;
  for (std::size_t i = 0; i < 4; ++i) mingled.insert(mingled.end(), {two[i], two[i + 4]});
  const std::vector<Case> cases = {
      {{{0, 1, 2}, {0, 2, 10}}, "face 1 of the mesh names vertex 10, which does not exist"},
      {{{0, 1, 1}}, "face 0 of the mesh has vertex 1 twice"},
      {{{0, 1, 2}, {0, 1, 3}},
       "face 1 of the mesh shares the edge of vertices 0 and 1 with face 0"},
      {{{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}, "shares the edge of vertices"},
      {{{0, 1, 2}, {0, 3, 4}}, "face 1 of the mesh meets others at vertex 0"},
      {two, "face 0 of the mesh meets others at vertex 0"},
      {mingled, "face 0 of the mesh meets others at vertex 0"}};
  std::ostringstream printed;
  std::streambuf* const err = std::cerr.rdbuf(printed.rdbuf());
  std::vector<std::string> messages;
  for (const Case& c : cases) {
    TriangleMesh mesh{.faces = c.faces};
    for (int i = 0; i < 10; ++i) mesh.positions.emplace_back(Eigen::Vector3f::Random());
    try {
      build_by_edge_collapse(mesh);
      messages.emplace_back("(taken)");
    } catch (const MeshError& e) {
      messages.emplace_back(e.what());
    }
  }
  std::cerr.rdbuf(err);
  CHECK(printed.str() == "");
  for (std::size_t i = 0; i < cases.size(); ++i) {
    CHECK_THAT(messages[i], Contains(cases[i].message));
    CHECK_THAT(messages[i], Contains("repair the mesh first"));
  }
}
