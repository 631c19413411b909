#include <ensonify/refine/triangle_mesh.h>

#include <algorithm>

#include <ensonify/refine/mesh_repair.h>

namespace ensonify::refine {

Bounds bounds(Triangles triangles) {
  Bounds box;
  if (triangles.faces.empty()) return box;
  box.lowest = box.highest = triangles.positions[triangles.faces.front()[0]];
  for (const Face& face : triangles.faces)
    for (const std::uint32_t vertex : face) {
      box.lowest = box.lowest.cwiseMin(triangles.positions[vertex]);
      box.highest = box.highest.cwiseMax(triangles.positions[vertex]);
    }
  return box;
}

MeshSummary summarise(const TriangleMesh& mesh) {
  const Bounds box = bounds(mesh);
  MeshSummary summary{.vertices = mesh.positions.size(),
                      .faces = mesh.faces.size(),
                      .lowest = mesh.world_origin + box.lowest.cast<double>(),
                      .highest = mesh.world_origin + box.highest.cast<double>()};
  const std::vector<std::uint32_t> place = weld(mesh.positions, 0.0);
  std::vector<std::uint64_t> edges;  // lower vertex in the high half, higher vertex in the low half
  edges.reserve(3 * mesh.faces.size());
  for (const Face& face : mesh.faces)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = place[face[k]], b = place[face[(k + 1) % 3]];
      if (a != b) edges.push_back(std::min(a, b) << 32 | std::max(a, b));
    }
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0, next = 0; i < edges.size(); i = next) {
    while (next < edges.size() && edges[next] == edges[i]) ++next;
    if (next - i == 1) ++summary.boundary_edges;
    if (next - i > 2) ++summary.non_manifold_edges;
  }
  return summary;
}

}  // namespace ensonify::refine
