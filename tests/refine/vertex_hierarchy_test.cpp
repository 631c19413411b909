#include <ensonify/refine/vertex_hierarchy.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <stdexcept>
#include <vector>

#include <ensonify/refine/edge_collapse.h>

#include "support/catch.h"
#include "support/meshes.h"

using namespace ensonify::refine;
using ensonify::tests::arrays_of;
using ensonify::tests::for_each_node;

namespace {

constexpr std::uint32_t none = ProgressiveMesh::none;

struct BuiltMesh {
  std::string name;
  TriangleMesh source;
  ProgressiveMesh mesh;
};
const std::vector<BuiltMesh>& built() {
  static const std::vector<BuiltMesh> all = [] {
    std::vector<BuiltMesh> out;
    for (auto& [name, mesh] : ensonify::tests::manifold_meshes())
      out.push_back({name, mesh, build_by_edge_collapse(mesh)});
    return out;
  }();
  return all;
}

std::vector<std::vector<std::uint32_t>> faces_at_leaves(const ProgressiveMesh& mesh) {
  std::vector<std::vector<std::uint32_t>> at(mesh.leaves());
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    if (mesh.source_face[f] != none)
      for (const std::uint32_t leaf : mesh.faces[f]) at[leaf].push_back(f);
  return at;
}

struct StarFit {
  std::size_t outside = 0;  ///< corners of closed stars outside their node's sphere
  double loosest = 0.0;     ///< the largest radius over the distance of the farthest corner
};
StarFit star_fit(const ProgressiveMesh& mesh) {
  const auto at = faces_at_leaves(mesh);
  StarFit fit;
  for_each_node(mesh, [&](auto node, auto lo, auto, auto hi, auto) {
    const Sphere& sphere = mesh.spheres[node];
    double farthest = 0.0;
    for (std::uint32_t leaf = lo; leaf < hi; ++leaf)
      for (const std::uint32_t face : at[leaf])
        for (const std::uint32_t corner : mesh.faces[face]) {
          const double distance =
              (mesh.points[corner].cast<double>() - sphere.centre.cast<double>()).norm();
          fit.outside += distance > double{sphere.radius};
          farthest = std::max(farthest, distance);
        }
    fit.loosest = std::max(fit.loosest, sphere.radius / farthest);
  });
  return fit;
}

}  // namespace

TEST_CASE("inner nodes are numbered in preorder over nested ranges of leaves") {
  for (const BuiltMesh& bed : built()) {
    INFO(bed.name);
    const ProgressiveMesh& mesh = bed.mesh;
    CHECK(mesh.leaves() == bed.source.positions.size());
    CHECK(mesh.mid.size() == mesh.leaves() - mesh.roots.size());
    CHECK(mesh.spheres.size() == mesh.mid.size());
    CHECK(mesh.order.size() == mesh.mid.size());
    CHECK(std::set(mesh.order.begin(), mesh.order.end()).size() == mesh.order.size());
    CHECK(*std::max_element(mesh.order.begin(), mesh.order.end()) + 1 == mesh.order.size());
    CHECK(mesh.roots.front() == 0);
    CHECK(std::is_sorted(mesh.roots.begin(), mesh.roots.end()));
    std::uint32_t next = 0, wrong = 0;
    for_each_node(mesh, [&](auto node, auto lo, auto mid, auto hi, auto parent) {
      wrong += node != next++ || !(lo < mid && mid < hi) || hi > mesh.leaves();
      wrong += parent != none && mesh.order[parent] <= mesh.order[node];
    });
    CHECK(next == mesh.mid.size());
    CHECK(wrong == 0);
  }
}

TEST_CASE("every source face is there once, with its corners in the source's order") {
  for (const auto& [name, source, mesh] : built()) {
    INFO(name);
    CHECK(mesh.faces.size() == mesh.source_face.size());
    std::vector<int> seen(source.faces.size(), 0);
    std::size_t wrong = 0;
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
      const std::uint32_t number = mesh.source_face[f];
      if (number == none) {
        wrong += mesh.faces[f] != Face{none, none, none};
        continue;
      }
      ++seen.at(number);
      for (std::size_t k = 0; k < 3; ++k)
        wrong += mesh.points[mesh.faces[f][k]] != source.positions[source.faces[number][k]];
    }
    CHECK(wrong == 0);
    CHECK(std::ranges::count(seen, 1) == static_cast<std::ptrdiff_t>(source.faces.size()));
    CHECK(std::is_sorted(
        mesh.source_face.end() - static_cast<std::ptrdiff_t>(mesh.base_faces().size()),
        mesh.source_face.end()));
  }
}

TEST_CASE("an inner node's faces have the corners left, right, cut and right, left, cut") {
  for (const BuiltMesh& bed : built()) {
    INFO(bed.name);
    const ProgressiveMesh& mesh = bed.mesh;
    std::size_t wrong = 0, empty = 0;
    for_each_node(mesh, [&](std::uint32_t node, auto lo, auto mid, auto hi, auto) {
      for (const std::size_t slot : {2 * std::size_t{node}, 2 * std::size_t{node} + 1}) {
        Face face = mesh.faces[slot];
        if (mesh.source_face[slot] == none) {
          ++empty;
          continue;
        }
        const auto cut =
            std::ranges::find_if(face, [&](auto leaf) { return leaf < lo || leaf >= hi; });
        if (cut == face.end()) {
          ++wrong;
          continue;
        }
        std::rotate(face.begin(), std::next(cut), face.end());  // cut last
        const bool left_first = face[0] < mid, right_second = face[1] >= mid;
        wrong += left_first != right_second || left_first != (slot % 2 == 0);
        wrong += face[1] < lo || face[1] >= hi;
      }
    });
    CHECK(wrong == 0);
    const bool closed = bed.name == "torus" || bed.name == "ball";
    CHECK((empty == 0) == closed);
  }
}

TEST_CASE("every sphere encloses all corners of the faces at its leaves, closely") {
  for (const auto& [name, source, mesh] : built()) {
    INFO(name);
    const StarFit fit = star_fit(mesh);
    CHECK(fit.outside == 0);
    CHECK(fit.loosest < 1.02);

    ProgressiveMeshArrays smaller = arrays_of(mesh);
    for (Sphere& sphere : smaller.spheres) sphere.radius /= 1.02f;
    CHECK(star_fit(smaller).outside >= mesh.spheres.size());
  }
}

TEST_CASE("spheres enclose their stars also far from the origin, where floats are coarse") {
  TriangleMesh source = ensonify::tests::open_grid(20, 20, 0.05, 0.05, 4);
  for (Eigen::Vector3f& p : source.positions) p += Eigen::Vector3f(9000.0f, -7000.0f, -3000.0f);
  CHECK(star_fit(build_by_edge_collapse(source)).outside == 0);
}

TEST_CASE("two triangles and their collapses give the hierarchy computed by hand") {
  // 3---2    First 1 collapses into 2, which removes 0 1 2, then 0 into 3, which removes 0 2 3.
  // | / |
  // 0---1
  TriangleMesh source;
  source.positions = {
      {0.0f, 0.0f, 0.0f}, {2.0f, 0.0f, 0.0f}, {2.0f, 2.0f, 0.0f}, {0.0f, 2.0f, 0.0f}};
  source.faces = {{0, 1, 2}, {2, 3, 0}};
  source.world_origin = {1.0, 2.0, 3.0};
  const std::vector<Collapse> collapses = {{.kept = 2, .removed = 1, .left_face = 0},
                                           {.kept = 3, .removed = 0, .right_face = 1}};
  const ProgressiveMeshArrays mesh = lay_out(source, collapses);
  CHECK(mesh.world_origin == source.world_origin);
  CHECK(mesh.roots == std::vector<std::uint32_t>{0, 2});
  CHECK(mesh.mid == std::vector<std::uint32_t>{1, 3});
  CHECK(mesh.order == std::vector<std::uint32_t>{0, 1});
  CHECK(mesh.points == std::vector<Eigen::Vector3f>{source.positions[1], source.positions[2],
                                                    source.positions[0], source.positions[3]});
  CHECK(mesh.source_face == std::vector<std::uint32_t>{0, none, none, 1});
  CHECK(mesh.faces ==
        std::vector<Face>{{2, 0, 1}, {none, none, none}, {none, none, none}, {1, 3, 2}});
  CHECK(ProgressiveMesh(mesh).base_faces().empty());
  for (const Sphere& sphere : mesh.spheres) {
    CHECK(sphere.centre == Eigen::Vector3f(1.0f, 1.0f, 0.0f));
    CHECK(sphere.radius == Approx(std::sqrt(2.0)).epsilon(1e-6));
  }
}

TEST_CASE("a mesh without collapses is its own base") {
  const TriangleMesh source = ensonify::tests::open_grid(4, 3, 1.0, 0.0, 1);
  const ProgressiveMesh mesh = lay_out(source, {});
  CHECK(mesh.roots.size() == source.positions.size());
  CHECK(std::ranges::equal(mesh.points, source.positions));
  CHECK(std::ranges::equal(mesh.base_faces(), source.faces));
  CHECK(ProgressiveMesh(lay_out({}, {})).leaves() == 0);
}

TEST_CASE("a hierarchy may be as deep as its number of vertices, on either side") {
  constexpr std::uint32_t n = 50'000;
  TriangleMesh source;
  for (std::uint32_t v = 0; v < n; ++v)
    source.positions.emplace_back(0.01f * static_cast<float>(v), static_cast<float>(v % 7), 0.0f);
  for (std::uint32_t v = 0; v + 2 < n; ++v)
    source.faces.push_back(v % 2 ? Face{v + 1, v, v + 2} : Face{v, v + 1, v + 2});
  std::vector<Collapse> to_left, to_right;
  for (std::uint32_t v = 1; v < n; ++v) {
    to_right.push_back({.kept = 0, .removed = v});
    to_left.push_back({.kept = v, .removed = v - 1});
  }
  for (const auto& collapses : {to_left, to_right}) {
    const ProgressiveMesh mesh = lay_out(source, collapses);
    CHECK(mesh.roots.size() == 1);
    CHECK(mesh.spheres.front().radius < 260.0f);
    std::size_t outside = 0;
    for (const Eigen::Vector3f& p : mesh.points)
      outside +=
          (p - mesh.spheres.front().centre).cast<double>().norm() > mesh.spheres.front().radius;
    CHECK(outside == 0);
  }
}

TEST_CASE("impossible collapses are refused") {
  const TriangleMesh source = ensonify::tests::open_grid(3, 3, 1.0, 0.0, 1);
  using Collapses = std::vector<Collapse>;
  CHECK_THROWS_AS(lay_out(source, Collapses{{9, 0}}), std::invalid_argument);
  CHECK_THROWS_AS(lay_out(source, Collapses{{0, 9}}), std::invalid_argument);
  CHECK_THROWS_AS(lay_out(source, Collapses{{0, none}}), std::invalid_argument);
  CHECK_THROWS_AS(lay_out(source, Collapses{{2, 2}}), std::invalid_argument);
  CHECK_THROWS_AS(lay_out(source, Collapses{{0, 1}, {2, 1}}), std::invalid_argument);
  CHECK_THROWS_AS(lay_out(source, Collapses{{0, 1}, {1, 2}}), std::invalid_argument);
  CHECK_THROWS_AS(lay_out(source, Collapses{{0, 1, 8, none}}), std::invalid_argument);
  CHECK_THROWS_AS(lay_out(source, Collapses{{0, 1, 3, 3}}), std::invalid_argument);
  CHECK_THROWS_AS(lay_out(source, Collapses{{0, 1, 3, none}, {0, 2, 3, none}}),
                  std::invalid_argument);
  CHECK_THROWS_AS(lay_out({.positions = source.positions, .faces = {{0, 1, 9}}}, {}),
                  std::invalid_argument);
}
