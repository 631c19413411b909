#include <ensonify/refine/triangle_mesh.h>

#include <algorithm>
#include <numeric>

#include <Eigen/Geometry>

#include <ensonify/refine/index.h>
#include <ensonify/refine/mesh_repair.h>

namespace ensonify::refine {

void append(TriangleMesh& mesh, Triangles more) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), more.positions.begin(), more.positions.end());
  for (const Face& face : more.faces)
    mesh.faces.push_back({face[0] + first, face[1] + first, face[2] + first});
}

Bounds bounds(Triangles triangles) {
  if (triangles.faces.empty()) return {};
  Eigen::AlignedBox3f box;
  for (const Face& face : triangles.faces)
    for (const std::uint32_t vertex : face) box.extend(triangles.positions[vertex]);
  return {box.min(), box.max()};
}

bool encloses_volume(Triangles triangles) {
  if (triangles.faces.empty()) return false;
  std::vector<std::uint64_t> edges;
  edges.reserve(3 * triangles.faces.size());
  for (const Face& face : triangles.faces)
    for (std::size_t k = 0; k < 3; ++k) edges.push_back(pack(face[k], face[(k + 1) % 3]));
  std::ranges::sort(edges);
  if (std::ranges::adjacent_find(edges) != edges.end()) return false;
  for (const std::uint64_t edge : edges) {
    const auto from = static_cast<std::uint32_t>(edge >> 32), to = static_cast<std::uint32_t>(edge);
    if (!std::ranges::binary_search(edges, pack(to, from))) return false;
  }

  std::vector<std::uint32_t> body(triangles.positions.size());  // by vertex: one of its body
  std::iota(body.begin(), body.end(), std::uint32_t{0});
  const auto body_of = [&](std::uint32_t vertex) {
    while (body[vertex] != vertex) vertex = body[vertex] = body[body[vertex]];
    return vertex;
  };
  for (const Face& face : triangles.faces)
    for (const std::size_t k : {1, 2}) body[body_of(face[k])] = body_of(face[0]);
  struct Volume {
    double sum = 0.0, size = 0.0;  // six times the volume; the sum of its terms' absolute values
  };
  std::vector<Volume> volumes(triangles.positions.size());
  for (std::uint32_t f = 0; f < triangles.faces.size(); ++f) {
    const std::uint32_t own = body_of(triangles.faces[f][0]);
    const Eigen::Vector3d a = triangles.corner(f, 0);
    const Eigen::Vector3d normal = (triangles.corner(f, 1) - a).cross(triangles.corner(f, 2) - a);
    const Eigen::Vector3d arm = a - triangles.positions[own].cast<double>();
    volumes[own].sum += arm.dot(normal);
    volumes[own].size += arm.norm() * normal.norm();
  }
  return std::ranges::all_of(triangles.faces, [&](const Face& face) {
    const Volume& volume = volumes[body_of(face[0])];
    return volume.sum > 1e-12 * volume.size;
  });
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
      const auto [low, high] = std::minmax(place[face[k]], place[face[(k + 1) % 3]]);
      if (low != high) edges.push_back(pack(low, high));
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
