#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <utility>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::tests {

/// The topology of the faces and the vertices they use.
struct Topology {
  std::size_t vertices = 0, edges = 0, faces = 0, components = 0, borders = 0;
  long euler() const { return static_cast<long>(vertices + faces) - static_cast<long>(edges); }
  /// The numbers that no collapse may change.
  std::array<long, 3> kept() const {
    return {euler(), static_cast<long>(components), static_cast<long>(borders)};
  }
};

/// The topology of faces, by vertex number; written for readability.
inline Topology topology(std::span<const refine::Face> faces) {
  std::map<std::uint32_t, std::uint32_t> up;  // union-find
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  std::map<std::uint32_t, std::uint32_t> along;  // borders: from a vertex to the next
  const auto top = [&](std::uint32_t v) {
    while (up.at(v) != v) v = up.at(v) = up.at(up.at(v));
    return v;
  };
  for (const refine::Face& f : faces)
    for (std::size_t k = 0; k < 3; ++k) {
      up.try_emplace(f[k], f[k]);
      edges.emplace(f[k], f[(k + 1) % 3]);
    }
  Topology out{.vertices = up.size(), .edges = 0, .faces = faces.size()};
  for (const auto& [a, b] : edges) {
    up[top(a)] = top(b);
    if (!edges.contains({b, a})) along[b] = a;
    out.edges += a < b || !edges.contains({b, a});
  }
  for (const auto& [v, parent] : up) out.components += v == parent;
  while (!along.empty()) {
    ++out.borders;
    for (auto at = along.begin(); at != along.end();) {
      const std::uint32_t next = at->second;
      along.erase(at);
      at = along.find(next);
    }
  }
  return out;
}

}  // namespace ensonify::tests
