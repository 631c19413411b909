#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <ensonify/refine/triangle_mesh.h>

namespace ensonify::tests {

/// Why half-edges cannot hold a mesh; empty if they can. Written for readability, with maps, and
/// independent of the code under test.
inline std::string manifold_fault(const refine::TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> face_of;  // directed edges
  std::map<std::uint32_t, std::vector<std::uint32_t>> faces_at;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.faces[f][k], b = mesh.faces[f][(k + 1) % 3];
      if (a >= mesh.positions.size()) return "an index out of range";
      if (a == b) return "a face with an edge of no length";
      if (!face_of.emplace(std::pair(a, b), f).second) return "a directed edge of two faces";
      faces_at[a].push_back(f);
    }
  if (faces_at.size() != mesh.positions.size()) return "a vertex that no face uses";
  for (const auto& [vertex, faces] : faces_at) {
    // Walks from face to face across the edges at this vertex.
    std::set<std::uint32_t> reached = {faces.front()};
    for (std::vector<std::uint32_t> queue = {faces.front()}; !queue.empty();) {
      const refine::Face face = mesh.faces[queue.back()];
      queue.pop_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = face[k], b = face[(k + 1) % 3];
        const auto other = face_of.find({b, a});
        if ((a == vertex || b == vertex) && other != face_of.end() &&
            reached.insert(other->second).second)
          queue.push_back(other->second);
      }
    }
    if (reached.size() != faces.size()) return "a vertex of several fans";
  }
  return "";
}

/// As above, for faces with any vertex numbers.
inline std::string manifold_fault(std::vector<refine::Face> faces) {
  std::map<std::uint32_t, std::uint32_t> number;
  for (refine::Face& face : faces)
    for (std::uint32_t& v : face) v = number.try_emplace(v, number.size()).first->second;
  refine::TriangleMesh mesh;
  mesh.faces = std::move(faces);
  mesh.positions.resize(number.size());
  return manifold_fault(mesh);
}

}  // namespace ensonify::tests
