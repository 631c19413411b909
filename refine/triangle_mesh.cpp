#include <ensonify/refine/triangle_mesh.h>

#include <algorithm>

namespace ensonify::refine {

Bounds bounds(Triangles triangles) {
  Bounds box;
  if (triangles.positions.empty()) return box;
  box.lowest = box.highest = triangles.positions.front();
  for (const Eigen::Vector3f& p : triangles.positions) {
    box.lowest = box.lowest.cwiseMin(p);
    box.highest = box.highest.cwiseMax(p);
  }
  return box;
}

MeshSummary summarise(const TriangleMesh& mesh) {
  const Bounds box = bounds(mesh);
  MeshSummary summary{.vertices = mesh.positions.size(),
                      .faces = mesh.faces.size(),
                      .lowest = mesh.world_origin + box.lowest.cast<double>(),
                      .highest = mesh.world_origin + box.highest.cast<double>()};
  std::vector<std::uint64_t> edges;  // lower vertex in the high half, higher vertex in the low half
  edges.reserve(3 * mesh.faces.size());
  for (const Face& face : mesh.faces)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = face[k], b = face[(k + 1) % 3];
      edges.push_back(std::min(a, b) << 32 | std::max(a, b));
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
