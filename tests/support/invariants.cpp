#include "support/invariants.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <ensonify/refine/footprint.h>

namespace ensonify::tests {
namespace {

using namespace ensonify::refine;

using Index = std::uint32_t;
constexpr Index none = ProgressiveMesh::none;
using Edge = std::pair<Index, Index>;

Index after(Index half_edge) { return half_edge % 4 == 2 ? half_edge - 2 : half_edge + 1; }

/// One line for each broken law: the first place, and the number of places.
class Findings {
 public:
  void expect(bool holds, std::string_view law, std::size_t place) {
    if (holds) return;
    const auto known = std::ranges::find(broken_, law, &Broken::law);
    if (known == broken_.end())
      broken_.push_back({std::string(law), place, 1});
    else
      ++known->count;
  }
  std::vector<std::string> lines() const {
    std::vector<std::string> out;
    for (const Broken& b : broken_)
      out.push_back(fmt::format("{}: first at {}, {} in all", b.law, b.place, b.count));
    return out;
  }

 private:
  struct Broken {
    std::string law;
    std::size_t place, count;
  };
  std::vector<Broken> broken_;
};

std::vector<Edge> undirected_edges(std::span<const Face> faces) {
  std::vector<Edge> edges;
  for (const Face& face : faces)
    if (face[0] != none)
      for (std::size_t k = 0; k < 3; ++k) edges.push_back(std::minmax(face[k], face[(k + 1) % 3]));
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

class Checker {
 public:
  explicit Checker(const ActiveMesh& mesh)
      : mesh_(mesh), whole_(mesh.progressive_mesh()), nodes_(mesh.nodes()), faces_(mesh.faces()) {}

  /// Each check relies on what the checks before it have verified.
  Findings run() {
    whole_.verify_all();
    check_tree();
    if (sound()) check_partition();
    if (sound()) check_faces();
    if (sound()) check_edges();
    if (sound()) check_topology();
    if (sound()) check_cuts();
    if (sound()) check_exact();
    return found_;
  }

 private:
  bool sound() const { return found_.lines().empty(); }

  void check_tree() {
    for (Index v = 0; v < nodes_.size(); ++v) {
      const ActiveMesh::Node& node = nodes_[v];
      if (node.hi == 0) continue;
      found_.expect(node.lo < node.hi && node.hi <= whole_.leaves(), "a node has leaves", v);
      found_.expect(node.is_leaf() || node.number < whole_.mid.size(), "an inner node has a number",
                    v);
      if (node.left == none) continue;
      const bool has_children = node.left % 2 == 0 && node.left + 1 < nodes_.size();
      found_.expect(has_children && !node.is_leaf(), "a split node has two children", v);
      if (!sound()) return;
      const Index mid = whole_.mid[node.number];
      const auto is_child = [&](const ActiveMesh::Node& child, Index lo, Index hi, Index number) {
        return child.lo == lo && child.hi == hi && child.parent == v &&
               (child.is_leaf() || child.number == number);
      };
      found_.expect(is_child(nodes_[node.left], node.lo, mid, node.number + 1) &&
                        is_child(nodes_[node.left + 1], mid, node.hi, node.number + mid - node.lo),
                    "children are the hierarchy's", v);
    }
  }

  void check_partition() {
    ancestor_.assign(whole_.leaves(), none);
    std::size_t active = 0;
    for (Index v = 0; v < nodes_.size(); ++v) {
      if (!nodes_[v].is_active()) continue;
      ++active;
      for (Index leaf = nodes_[v].lo; leaf < nodes_[v].hi; ++leaf) {
        found_.expect(ancestor_[leaf] == none, "a leaf has at most one active ancestor", leaf);
        ancestor_[leaf] = v;
      }
    }
    for (Index leaf = 0; leaf < whole_.leaves(); ++leaf)
      found_.expect(ancestor_[leaf] != none, "a leaf has an active ancestor", leaf);
    found_.expect(active == mesh_.vertex_count(), "vertex_count() counts", active);
  }

  std::array<Index, 3> ancestors(const Face& face) const {
    return {ancestor_[face[0]], ancestor_[face[1]], ancestor_[face[2]]};
  }

  void check_faces() {
    std::vector<int> seen(whole_.faces.size(), 0);
    std::size_t active = 0;
    for (Index f = 0; f < faces_.size(); ++f) {
      if (faces_[f].slot == none) continue;
      ++active;
      found_.expect(faces_[f].slot < whole_.faces.size(), "a face is an original one", f);
      if (!sound()) return;
      ++seen[faces_[f].slot];
      const Face& face = whole_.faces[faces_[f].slot];
      found_.expect(face[0] != none && faces_[f].vertices == ancestors(face),
                    "a face joins its corners' active ancestors, in its own order", f);
    }
    for (std::size_t slot = 0; slot < seen.size(); ++slot) {
      if (whole_.faces[slot][0] == none) continue;
      const auto [a, b, c] = ancestors(whole_.faces[slot]);
      found_.expect(seen[slot] == (a != b && b != c && c != a),
                    "active are the original faces with three active ancestors, once", slot);
    }
    found_.expect(active == mesh_.face_count(), "face_count() counts", active);
  }

  Index from(Index h) const { return faces_[h / 4].vertices[h % 4]; }
  Index to(Index h) const { return from(after(h)); }
  Index opposite(Index h) const { return faces_[h / 4].opposites[h % 4]; }

  void check_edges() {
    std::vector<std::pair<Edge, Index>> edges;  // directed
    std::vector<std::size_t> degree(nodes_.size(), 0);
    std::vector<bool> on_border(nodes_.size(), false);
    for (Index f = 0; f < faces_.size(); ++f)
      if (faces_[f].slot != none)
        for (Index h = 4 * f; h < 4 * f + 3; ++h) {
          edges.push_back({{from(h), to(h)}, h});
          ++degree[from(h)];
        }
    std::ranges::sort(edges);
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const auto& [edge, h] = edges[e];
      found_.expect(e == 0 || edges[e - 1].first != edge, "a directed edge is there once", h);
      const auto back = std::ranges::lower_bound(edges, Edge(edge.second, edge.first), {},
                                                 &std::pair<Edge, Index>::first);
      const bool border = back == edges.end() || back->first != Edge(edge.second, edge.first);
      found_.expect(opposite(h) == (border ? none : back->second),
                    "a half-edge's opposite is the one back, if there is one", h);
      if (border) on_border[edge.first] = true;
    }
    if (!sound()) return;
    for (Index v = 0; v < nodes_.size(); ++v) {
      if (!nodes_[v].is_active()) continue;
      const Index first = nodes_[v].half_edge;
      found_.expect((first == none) == (degree[v] == 0), "a vertex with faces has a half-edge", v);
      if (first == none || degree[v] == 0) continue;
      const bool leaves = first / 4 < faces_.size() && first % 4 < 3 &&
                          faces_[first / 4].slot != none && from(first) == v;
      found_.expect(leaves, "a vertex's half-edge leaves it", v);
      if (!leaves) continue;
      found_.expect(!on_border[v] || opposite(first) == none,
                    "a border vertex knows its fan's first", v);
      std::size_t walked = 0;
      Index h = first;
      do {
        ++walked;
        h = opposite(after(after(h)));
      } while (h != none && h != first && walked < degree[v]);
      found_.expect(walked == degree[v] && h == (on_border[v] ? none : first),
                    "a vertex's faces are one fan", v);
    }
  }

  /// Euler's characteristic of the whole mesh and of the original faces under each vertex.
  void check_topology() {
    const std::vector<Edge> edges = undirected_edges(whole_.faces);
    std::vector<long> euler(nodes_.size(), 0), parts(nodes_.size(), 0);
    std::vector<Index> up(whole_.leaves());  // union-find
    std::iota(up.begin(), up.end(), Index{0});
    const auto top = [&](Index leaf) {
      while (up[leaf] != leaf) leaf = up[leaf] = up[up[leaf]];
      return leaf;
    };
    for (Index leaf = 0; leaf < whole_.leaves(); ++leaf) {
      ++euler[ancestor_[leaf]];
      ++parts[ancestor_[leaf]];
    }
    for (const auto& [a, b] : edges) {
      if (ancestor_[a] != ancestor_[b]) continue;
      --euler[ancestor_[a]];
      if (top(a) == top(b)) continue;
      up[top(a)] = top(b);
      --parts[ancestor_[a]];
    }
    long faces = 0;
    for (const Face& face : whole_.faces) {
      if (face[0] == none) continue;
      ++faces;
      const auto [a, b, c] = ancestors(face);
      if (a == b && b == c) ++euler[a];
    }
    for (Index v = 0; v < nodes_.size(); ++v)
      if (nodes_[v].is_active())
        found_.expect(parts[v] == 1 && euler[v] == 1, "a vertex stands for a disc", v);

    std::vector<Face> active;
    for (const ActiveMesh::ActiveFace& face : faces_)
      if (face.slot != none) active.push_back(face.vertices);
    const long before =
        static_cast<long>(whole_.leaves()) - static_cast<long>(edges.size()) + faces;
    const long now = static_cast<long>(mesh_.vertex_count() + active.size()) -
                     static_cast<long>(undirected_edges(active).size());
    found_.expect(before == now, "Euler's characteristic is the original's",
                  static_cast<std::size_t>(std::abs(now - before)));
  }

  void check_cuts() {
    std::vector<Edge> edges;
    for (Index f = 0; f < faces_.size(); ++f)
      if (faces_[f].slot != none)
        for (Index h = 4 * f; h < 4 * f + 3; ++h)
          edges.insert(edges.end(), {{from(h), to(h)}, {to(h), from(h)}});
    std::ranges::sort(edges);
    for (Index v = 0; v < nodes_.size(); ++v) {
      const ActiveMesh::Node& node = nodes_[v];
      if (!node.is_active() || node.is_leaf()) continue;
      std::array<Index, 2> cuts = {none, none};
      for (Index s = 0; s < 2; ++s) {
        const Face& face = whole_.faces[2 * node.number + s];
        if (face[0] == none) continue;
        const auto cut = std::ranges::find_if(face, [&](Index l) { return !node.covers(l); });
        found_.expect(cut != face.end(), "a fundamental face has a cut", v);
        if (cut == face.end()) continue;
        cuts[s] = ancestor_[*cut];
        found_.expect(std::ranges::binary_search(edges, Edge(v, cuts[s])),
                      "cut vertices are in the one-ring", v);
      }
      if (cuts[0] != cuts[1] || cuts[0] == none) continue;
      const ActiveMesh::Node& cut = nodes_[cuts[0]];
      found_.expect(!cut.is_leaf() && whole_.order[cut.number] > whole_.order[node.number],
                    "what a split would force was collapsed later", v);
    }
  }

  void check_exact() {
    std::vector<std::pair<Index, Face>> expected;
    for (std::size_t slot = 0; slot < whole_.faces.size(); ++slot) {
      const Face& face = whole_.faces[slot];
      if (face[0] != none &&
          std::ranges::all_of(face, [&](Index leaf) { return nodes_[ancestor_[leaf]].is_leaf(); }))
        expected.push_back({whole_.source_face[slot], face});
    }
    std::ranges::sort(expected);
    const ExactFaces exact = mesh_.exact_faces();
    const bool complete = exact.faces.size() == expected.size() &&
                          exact.source_faces.size() == expected.size() &&
                          exact.points.data() == whole_.points.data();
    found_.expect(complete, "exact are all faces of three leaves", expected.size());
    if (!complete) return;
    for (std::size_t f = 0; f < expected.size(); ++f)
      found_.expect(expected[f] == std::pair(exact.source_faces[f], exact.faces[f]),
                    "exact are the faces of three leaves, ascending, each with its number", f);
  }

  const ActiveMesh& mesh_;
  const ProgressiveMesh& whole_;
  std::span<const ActiveMesh::Node> nodes_;
  std::span<const ActiveMesh::ActiveFace> faces_;
  std::vector<Index> ancestor_;  // by leaf: its active ancestor
  Findings found_;
};

}  // namespace

std::vector<std::string> broken_invariants(const ActiveMesh& mesh) {
  return Checker(mesh).run().lines();
}

std::vector<std::string> broken_invariants(const ActiveMesh& mesh,
                                           std::span<const FanVolume> volumes) {
  Findings found = Checker(mesh).run();
  if (!found.lines().empty()) return found.lines();
  const ViewTest view(volumes);
  const auto nodes = mesh.nodes();
  for (std::size_t v = 0; v < nodes.size(); ++v)
    if (nodes[v].is_active() && !nodes[v].is_leaf())
      found.expect(!view.touches(mesh.progressive_mesh().spheres[nodes[v].number]),
                   "no active inner sphere meets a volume", v);
  const auto exact = mesh.exact_faces().source_faces;  // ascending
  Footprint footprint(mesh.progressive_mesh());
  for (const Index source : footprint.query(volumes).source_faces)
    found.expect(std::ranges::binary_search(exact, source),
                 "the exact faces contain the footprint's", source);
  return found.lines();
}

std::vector<std::string> broken_invariants(const ProgressiveMesh& mesh) {
  mesh.verify_all();
  Findings found;
  std::vector<std::vector<Index>> slots(mesh.leaves());  // by leaf: the faces' indices
  for (Index slot = 0; slot < mesh.faces.size(); ++slot)
    if (mesh.faces[slot][0] != none)
      for (const Index leaf : mesh.faces[slot]) slots[leaf].push_back(slot);
  struct Branch {
    Index number, lo, hi;
  };
  std::vector<Branch> pending;
  for (Index r = 0; r < mesh.roots.size(); ++r)
    pending.push_back({mesh.roots[r] - r, mesh.roots[r], mesh.end_of(r)});
  while (!pending.empty()) {
    const auto [number, lo, hi] = pending.back();
    pending.pop_back();
    if (hi - lo == 1) continue;
    const Sphere& sphere = mesh.spheres[number];
    for (Index leaf = lo; leaf < hi; ++leaf)
      for (const Index slot : slots[leaf])
        for (const Index corner : mesh.faces[slot])
          found.expect((mesh.points[corner].cast<double>() - sphere.centre.cast<double>()).norm() <=
                           double{sphere.radius},
                       "a node's sphere contains the faces at its leaves", number);
    const Index mid = mesh.mid_of(number, lo, hi);
    pending.push_back({number + 1, lo, mid});
    pending.push_back({number + (mid - lo), mid, hi});
  }
  return found.lines();
}

bool has_all_faces(const refine::ActiveMesh& mesh, const refine::TriangleMesh& source) {
  const refine::ExactFaces exact = mesh.exact_faces();
  if (exact.faces.size() != source.faces.size()) return false;
  for (std::size_t f = 0; f < source.faces.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k)
      if (exact.source_faces[f] != f ||
          exact.points[exact.faces[f][k]] != source.positions[source.faces[f][k]])
        return false;
  return true;
}

}  // namespace ensonify::tests
