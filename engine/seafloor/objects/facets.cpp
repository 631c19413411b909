#include <ensonify/engine/seafloor/objects/facets.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

namespace ensonify::engine {
double facet_angle_rad(const ObjectMesh& mesh) {
  struct Edge {
    std::uint32_t from, to, face;
  };
  std::vector<Edge> edges;
  std::vector<Eigen::Vector3d> normals;
  edges.reserve(3 * mesh.faces.size());
  normals.reserve(mesh.faces.size());
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const refine::Face& face = mesh.faces[f];
    const Eigen::Vector3d a = mesh.corner(f, 0);
    normals.push_back((mesh.corner(f, 1) - a).cross(mesh.corner(f, 2) - a).normalized());
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [from, to] = std::minmax(face[k], face[(k + 1) % 3]);
      edges.push_back({from, to, f});
    }
  }
  std::ranges::sort(edges, {}, [](const Edge& e) { return std::pair(e.from, e.to); });
  double round = 0.0, sharp = 0.0, squares = 0.0;  // sums of angle (angle^2) times length
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    const Edge &a = edges[i], &b = edges[i + 1];
    if (a.from != b.from || a.to != b.to) continue;
    const Eigen::Vector3d &m = normals[a.face], &n = normals[b.face];
    const double angle_rad = std::atan2(m.cross(n).norm(), m.dot(n));
    if (!(angle_rad > flattest_rad)) continue;
    const double length_m = (mesh.positions[a.to] - mesh.positions[a.from]).norm();
    if (angle_rad > sharpest_rad) {
      sharp += angle_rad * length_m;
    } else {
      round += angle_rad * length_m;
      squares += angle_rad * angle_rad * length_m;
    }
  }
  return round > sharp ? squares / round : 0.0;
}

}  // namespace ensonify::engine
