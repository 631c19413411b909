#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <ensonify/refine/progressive_mesh.h>
#include <ensonify/refine/vertex_hierarchy.h>

#include "support/meshes.h"

namespace ensonify::tests {

/// A hierarchy of legal collapses in random order, a harder case than a good hierarchy. Written for
/// readability, without half-edges.
inline refine::ProgressiveMeshArrays random_hierarchy(const refine::TriangleMesh& source,
                                                      std::uint64_t seed) {
  constexpr std::uint32_t none = refine::ProgressiveMesh::none;
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  Random random(seed);
  std::vector<refine::Face> faces = source.faces;  // a removed face has `none` three times
  std::vector<refine::Collapse> collapses;
  for (;;) {
    std::map<Edge, std::uint32_t> face_at;  // by directed edge
    std::map<std::uint32_t, std::set<std::uint32_t>> ring;
    std::set<std::uint32_t> on_border;
    for (std::uint32_t f = 0; f < faces.size(); ++f)
      if (faces[f][0] != none)
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t a = faces[f][k], b = faces[f][(k + 1) % 3];
          face_at[{a, b}] = f;
          ring[a].insert(b);
          ring[b].insert(a);
        }
    for (const auto& [edge, f] : face_at)
      if (!face_at.contains({edge.second, edge.first})) on_border.insert({edge.first, edge.second});
    const auto at = [&](std::uint32_t a, std::uint32_t b) {
      const auto found = face_at.find({a, b});
      return found == face_at.end() ? none : found->second;
    };
    const auto legal = [&](std::uint32_t a, std::uint32_t b) {
      std::set<std::uint32_t> common, cuts;
      std::ranges::set_intersection(ring[a], ring[b], std::inserter(common, common.end()));
      for (const auto& [from, to] : {Edge(a, b), Edge(b, a)})
        if (at(from, to) != none)
          for (const std::uint32_t cut : faces[at(from, to)])
            if (cut != a && cut != b) {
              cuts.insert(cut);
              if (at(cut, to) == none && at(from, cut) == none) return false;
            }
      const bool inside = at(a, b) != none && at(b, a) != none;
      const auto peak = [&](std::uint32_t v) {
        return !on_border.contains(v) && ring[v].size() == 3;
      };
      return common == cuts && !(inside && on_border.contains(a) && on_border.contains(b)) &&
             !(peak(a) && peak(b));
    };
    std::vector<Edge> edges;
    for (const auto& [edge, f] : face_at) edges.push_back(edge);
    for (std::size_t i = edges.size(); i > 1; --i) std::swap(edges[i - 1], edges[random() % i]);
    const auto chosen = std::ranges::find_if(
        edges, [&](const Edge& edge) { return legal(edge.first, edge.second); });
    if (chosen == edges.end()) return refine::lay_out(source, collapses);
    const auto [removed, kept] = *chosen;
    collapses.push_back({kept, removed, at(removed, kept), at(kept, removed)});
    for (const std::uint32_t f : {at(removed, kept), at(kept, removed)})
      if (f != none) faces[f] = {none, none, none};
    for (refine::Face& face : faces) std::ranges::replace(face, removed, kept);
  }
}

}  // namespace ensonify::tests
