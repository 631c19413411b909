#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <ensonify/refine/progressive_mesh.h>

namespace ensonify::tests {

using Random = std::mt19937_64;

/// A uniform number in [low, high). Every standard library gives the same numbers.
inline double uniform(Random& random, double low = 0.0, double high = 1.0) {
  return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

/// A direction that is uniform on the unit sphere.
inline Eigen::Vector3d direction(Random& random) {
  const double z = uniform(random, -1.0, 1.0), angle = uniform(random, 0.0, 2.0 * std::numbers::pi);
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// A uniformly random right-handed orthonormal frame, as columns.
inline Eigen::Matrix3d frame(Random& random) {
  Eigen::Matrix3d axes;
  axes.col(0) = direction(random);
  axes.col(1) = axes.col(0).cross(direction(random)).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

/// Columns x rows vertices placed by (column, row), with two triangles between each four,
/// counter-clockwise in (column, row); the diagonal is random if `random` is given. `wrap` joins
/// the last column to the first, and the last row too: a torus.
inline refine::TriangleMesh sheet(std::uint32_t columns, std::uint32_t rows,
                                  const std::function<Eigen::Vector3d(double, double)>& place,
                                  Random* random = nullptr, bool wrap = false) {
  refine::TriangleMesh mesh;
  for (std::uint32_t j = 0; j < rows; ++j)
    for (std::uint32_t i = 0; i < columns; ++i)
      mesh.positions.emplace_back(place(i, j).cast<float>());
  const auto vertex = [&](std::uint32_t i, std::uint32_t j) {
    return j % rows * columns + i % columns;
  };
  const std::uint32_t open = wrap ? 0 : 1;
  for (std::uint32_t j = 0; j + open < rows; ++j)
    for (std::uint32_t i = 0; i + open < columns; ++i) {
      std::array<std::uint32_t, 4> a{vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1),
                                     vertex(i, j + 1)};
      if (random && (*random)() % 2) std::rotate(a.begin(), a.begin() + 1, a.end());
      mesh.faces.push_back({a[0], a[1], a[2]});
      mesh.faces.push_back({a[0], a[2], a[3]});
    }
  return mesh;
}

/// A grid with random heights around the origin.
inline refine::TriangleMesh open_grid(std::uint32_t columns, std::uint32_t rows, double cell_m,
                                      double relief_m, std::uint64_t seed) {
  Random random(seed);
  return sheet(
      columns, rows,
      [&](double i, double j) {
        return Eigen::Vector3d(cell_m * (i - 0.5 * (columns - 1)), cell_m * (j - 0.5 * (rows - 1)),
                               relief_m * uniform(random, -0.5, 0.5));
      },
      &random);
}

/// The mesh without some of its faces and without unused vertices.
inline refine::TriangleMesh without(const refine::TriangleMesh& mesh,
                                    const std::function<bool(std::uint32_t)>& drop) {
  refine::TriangleMesh out{.world_origin = mesh.world_origin};
  std::map<std::uint32_t, std::uint32_t> number;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    if (drop(f)) continue;
    refine::Face face = mesh.faces[f];
    for (std::uint32_t& vertex : face) {
      const auto [at, isnew] = number.try_emplace(vertex, out.positions.size());
      if (isnew) out.positions.push_back(mesh.positions[vertex]);
      vertex = at->second;
    }
    out.faces.push_back(face);
  }
  return out;
}

/// A grid with square holes, one of them a single square wide.
inline refine::TriangleMesh holed_grid(std::uint32_t cells, double cell_m, double relief_m,
                                       std::uint64_t seed) {
  const auto hole = [](std::uint32_t i, std::uint32_t j) {
    return (i % 9 >= 3 && i % 9 < 6 && j % 7 >= 2 && j % 7 < 5) || (i == 1 && j == 1);
  };
  return without(open_grid(cells + 1, cells + 1, cell_m, relief_m, seed),
                 [&](std::uint32_t f) { return hole(f / 2 % cells, f / 2 / cells); });
}

/// A mesh like breaking waves: each crest overhangs the trough before the crest.
inline refine::TriangleMesh overhang(std::uint32_t columns, std::uint32_t rows, double cell_m,
                                     std::uint64_t seed) {
  Random random(seed);
  return sheet(
      columns, rows,
      [&](double i, double j) {
        const double x = cell_m * (i - 0.5 * columns), y = cell_m * (j - 0.5 * rows);
        const double period = 12.0 * cell_m, phase = 2.0 * std::numbers::pi * x / period;
        return Eigen::Vector3d(x + 0.35 * period * std::sin(phase),
                               y + 0.1 * cell_m * uniform(random, -1.0, 1.0),
                               0.2 * period * std::cos(phase));
      },
      &random);
}

/// A closed mesh with one handle, oriented outwards, about the z axis.
inline refine::TriangleMesh torus(std::uint32_t around, std::uint32_t across, double radius_m,
                                  double tube_m) {
  return sheet(
      around, across,
      [&](double i, double j) {
        const double u = 2.0 * std::numbers::pi * i / around;
        const double v = 2.0 * std::numbers::pi * j / across;
        const double r = radius_m + tube_m * std::cos(v);
        return Eigen::Vector3d(r * std::cos(u), r * std::sin(u), tube_m * std::sin(v));
      },
      nullptr, true);
}

/// A closed mesh, oriented outwards: an octahedron, each face cut into four `level` times.
inline refine::TriangleMesh ball(int level, double radius_m) {
  refine::TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const float sign : {1.0f, -1.0f})
      mesh.positions.emplace_back(sign * Eigen::Vector3f::Unit(axis));
  mesh.faces = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int l = 0; l < level; ++l) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, isnew] = middles.try_emplace(std::minmax(a, b), mesh.positions.size());
      if (isnew)
        mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]).normalized().eval());
      return at->second;
    };
    std::vector<refine::Face> faces;
    for (const auto& [a, b, c] : mesh.faces) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      faces.insert(faces.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.faces = std::move(faces);
  }
  for (Eigen::Vector3f& p : mesh.positions) p *= static_cast<float>(radius_m);
  return mesh;
}

/// Adds the other mesh's faces, moved.
inline void join(refine::TriangleMesh& mesh, const refine::TriangleMesh& other,
                 const Eigen::Vector3f& move) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Eigen::Vector3f& p : other.positions) mesh.positions.emplace_back(p + move);
  for (const auto& [a, b, c] : other.faces) mesh.faces.push_back({first + a, first + b, first + c});
}

/// The same surface with vertices and faces in random order and each face starting at a random
/// corner.
inline refine::TriangleMesh shuffled(const refine::TriangleMesh& mesh, std::uint64_t seed) {
  Random random(seed);
  const auto order = [&](std::size_t n) {
    std::vector<std::uint32_t> to(n);
    for (std::uint32_t i = 0; i < n; ++i) to[i] = i;
    for (std::size_t i = n; i > 1; --i) std::swap(to[i - 1], to[random() % i]);
    return to;
  };
  refine::TriangleMesh out = mesh;
  const std::vector<std::uint32_t> vertex = order(mesh.positions.size()),
                                   face = order(mesh.faces.size());
  for (std::size_t v = 0; v < vertex.size(); ++v) out.positions[vertex[v]] = mesh.positions[v];
  for (std::size_t f = 0; f < face.size(); ++f) {
    refine::Face corners = mesh.faces[f];
    std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(random() % 3),
                corners.end());
    for (std::uint32_t& c : corners) c = vertex[c];
    out.faces[face[f]] = corners;
  }
  return out;
}

/// Calls visit(node, lo, mid, hi, parent) for each inner node, from the roots down; a root's parent
/// is `none`.
template <class Visit>
void for_each_node(const refine::ProgressiveMesh& mesh, Visit visit) {
  struct Branch {
    std::uint32_t node, lo, hi, parent;
  };
  std::vector<Branch> pending;
  for (std::size_t r = mesh.roots.size(); r-- > 0;)
    pending.push_back({mesh.roots[r] - static_cast<std::uint32_t>(r), mesh.roots[r], mesh.end_of(r),
                       refine::ProgressiveMesh::none});
  while (!pending.empty()) {
    const auto [node, lo, hi, parent] = pending.back();
    pending.pop_back();
    if (hi - lo == 1) continue;
    const std::uint32_t mid = mesh.mid[node];
    visit(node, lo, mid, hi, parent);
    pending.push_back({node + (mid - lo), mid, hi, node});
    pending.push_back({node + 1, lo, mid, node});
  }
}

/// A random fan near a mesh that is about `size_m` wide.
inline refine::FanVolume random_volume(Random& random, double size_m) {
  constexpr double degree = std::numbers::pi / 180.0;
  const Eigen::Matrix3d axes = frame(random);
  const double half_sector = uniform(random, 5.0, 80.0) * degree;
  const Eigen::Vector3d towards_apex = direction(random);  // drawn alike by every compiler
  return {.apex = 0.6 * size_m * uniform(random) * towards_apex,
          .array_axis = axes.col(0),
          .middle = axes.col(1),
          .pole = axes.col(2),
          .truncation_rad = uniform(random, 0.1, 4.0) * degree,
          .elevation_low_rad = -half_sector,
          .elevation_high_rad = half_sector,
          .range_m = uniform(random, 0.2, 1.0) * size_m};
}

/// A copy of a progressive mesh's arrays, for changing them.
inline refine::ProgressiveMeshArrays arrays_of(const refine::ProgressiveMesh& mesh) {
  const auto copy = [](const auto& span) { return std::vector(span.begin(), span.end()); };
  return {.points = copy(mesh.points),
          .mid = copy(mesh.mid),
          .spheres = copy(mesh.spheres),
          .order = copy(mesh.order),
          .faces = copy(mesh.faces),
          .source_face = copy(mesh.source_face),
          .roots = copy(mesh.roots),
          .world_origin = mesh.world_origin};
}

/// Whether all arrays of two progressive meshes have the same bytes.
inline bool same_bytes(const refine::ProgressiveMesh& a, const refine::ProgressiveMesh& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() &&
           (x.empty() || std::memcmp(x.data(), y.data(), x.size_bytes()) == 0);
  };
  return same(a.points, b.points) && same(a.mid, b.mid) && same(a.spheres, b.spheres) &&
         same(a.order, b.order) && same(a.faces, b.faces) && same(a.source_face, b.source_face) &&
         same(a.roots, b.roots) && a.world_origin == b.world_origin;
}

/// The mesh with spheres as OpenMesh's view-dependent classes make them: around only the vertices.
inline refine::ProgressiveMesh over_vertices_only(const refine::ProgressiveMesh& mesh) {
  refine::ProgressiveMeshArrays out = arrays_of(mesh);
  for_each_node(mesh, [&](auto node, auto lo, auto, auto hi, auto) {
    Eigen::AlignedBox3f box;
    for (std::uint32_t leaf = lo; leaf < hi; ++leaf) box.extend(mesh.points[leaf]);
    refine::Sphere& sphere = out.spheres[node];
    sphere = {box.center(), 0.0f};
    for (std::uint32_t leaf = lo; leaf < hi; ++leaf)
      sphere.radius = std::max(sphere.radius, (mesh.points[leaf] - sphere.centre).norm());
  });
  return out;
}

struct NamedMesh {
  std::string name;
  refine::TriangleMesh mesh;
};

/// One mesh of each kind that refinement must handle, about 40 m wide around the origin, all
/// manifold, of some thousand faces or, if not `big`, some hundred.
inline std::vector<NamedMesh> manifold_meshes(bool big = true) {
  const std::uint32_t n = big ? 40 : 14;
  const double cell_m = 40.0 / n;
  refine::TriangleMesh several = open_grid(n / 2, n / 2, 2.0 * cell_m, 0.5, 3);
  join(several, torus(n / 2, n / 3, 6.0, 2.0), {3.0f, 2.0f, 4.0f});
  join(several, ball(big ? 3 : 1, 3.0), {-8.0f, 5.0f, 4.0f});
  several.positions.emplace_back(0.0f, 0.0f, 9.0f);  // an unused vertex
  return {{"open grid", shuffled(open_grid(n, n, cell_m, cell_m, 1), 11)},
          {"level grid", open_grid(n, n, cell_m, 0.0, 2)},
          {"grid with holes", shuffled(holed_grid(n, cell_m, cell_m, 2), 12)},
          {"overhang", shuffled(overhang(n, n, cell_m, 3), 13)},
          {"torus", shuffled(torus(2 * n, n, 15.0, 5.0), 14)},
          {"ball", shuffled(ball(big ? 4 : 2, 15.0), 15)},
          {"several components", shuffled(several, 16)}};
}

/// A mesh of these faces, with its vertices in random directions.
inline refine::TriangleMesh random_vertices(std::vector<refine::Face> faces, std::size_t vertices) {
  refine::TriangleMesh mesh{.faces = std::move(faces)};
  Random random(vertices);
  for (std::size_t v = 0; v < vertices; ++v)
    mesh.positions.emplace_back((10.0 * direction(random)).cast<float>());
  return mesh;
}

/// The smallest mesh of each kind.
inline std::vector<NamedMesh> smallest_meshes() {
  std::vector<NamedMesh> meshes;
  const auto add = [&](const char* name, std::vector<refine::Face> faces, std::size_t vertices) {
    meshes.push_back({name, random_vertices(std::move(faces), vertices)});
  };
  add("nothing", {}, 0);
  add("lone vertices", {}, 3);
  add("one face", {{0, 1, 2}}, 3);
  add("two faces", {{0, 1, 2}, {2, 1, 3}}, 4);
  add("a closed fan", {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}}, 5);
  add("a tetrahedron", {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}, 4);
  add("two tetrahedra as one", {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {1, 0, 4}, {2, 1, 4}, {0, 2, 4}},
      5);
  return meshes;
}

}  // namespace ensonify::tests
