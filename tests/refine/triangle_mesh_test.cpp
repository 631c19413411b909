#include <ensonify/refine/triangle_mesh.h>

#include <cstddef>
#include <cstdint>
#include <utility>

#include "support/catch.h"

using namespace ensonify::refine;

TEST_CASE("An empty mesh has a summary of zeros") {
  const MeshSummary summary = summarise({});
  CHECK(summary.vertices == 0);
  CHECK(summary.faces == 0);
  CHECK(summary.boundary_edges == 0);
  CHECK(summary.non_manifold_edges == 0);
}

TEST_CASE("A closed surface has no boundary, and its bounds are in world coordinates") {
  TriangleMesh tetrahedron;
  tetrahedron.positions = {
      {0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, -4}, {9, 9, 9}};  // the last is unused
  tetrahedron.faces = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
  tetrahedron.world_origin = {148376.0, 6234000.0, 10.0};
  const MeshSummary summary = summarise(tetrahedron);
  CHECK(summary.vertices == 5);
  CHECK(summary.faces == 4);
  CHECK(summary.boundary_edges == 0);
  CHECK(summary.non_manifold_edges == 0);
  CHECK(summary.lowest == Eigen::Vector3d(148376.0, 6234000.0, 6.0));
  CHECK(summary.highest == Eigen::Vector3d(148378.0, 6234003.0, 10.0));
}

TEST_CASE("A sheet's boundary is its rim, for any orientation of its faces") {
  TriangleMesh sheet;
  constexpr std::uint32_t columns = 5, rows = 4;  // of vertices
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column)
      sheet.positions.emplace_back(float(column), float(row), 0.0f);
  for (std::uint32_t row = 0; row + 1 < rows; ++row)
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      const std::uint32_t a = row * columns + column, b = a + 1, c = a + columns, d = c + 1;
      sheet.faces.push_back({a, b, d});
      sheet.faces.push_back(row % 2 ? Face{a, d, c} : Face{a, c, d});
    }
  const MeshSummary summary = summarise(sheet);
  CHECK(summary.boundary_edges == 2 * (columns - 1) + 2 * (rows - 1));
  CHECK(summary.non_manifold_edges == 0);
}

TEST_CASE("An edge of three faces is not manifold") {
  TriangleMesh book;
  book.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}};
  book.faces = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}};
  const MeshSummary summary = summarise(book);
  CHECK(summary.non_manifold_edges == 1);
  CHECK(summary.boundary_edges == 6);
}

TEST_CASE("Faces enclose a volume if no edge is open and each body's volume is positive") {
  const TriangleMesh body{.positions = {{1e4, 0, 0}, {1e4 + 2, 0, 0}, {1e4, 3, 0}, {1e4, 0, 5}},
                          .faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
  const auto turned = [](TriangleMesh mesh) {
    for (Face& face : mesh.faces) std::swap(face[1], face[2]);
    return mesh;
  };
  const auto both = [](TriangleMesh mesh, const TriangleMesh& other) {
    append(mesh, other);
    return mesh;
  };
  CHECK(encloses_volume(body));
  CHECK(encloses_volume(both(body, body)));
  CHECK_FALSE(encloses_volume(TriangleMesh{}));
  CHECK_FALSE(encloses_volume(turned(body)));
  TriangleMesh large = body;
  for (Eigen::Vector3f& p : large.positions) p *= 2.0f;
  CHECK_FALSE(encloses_volume(both(large, turned(body))));  // the sum is positive
  for (std::size_t f = 0; f < body.faces.size(); ++f) {
    TriangleMesh faulty = body;
    std::swap(faulty.faces[f][0], faulty.faces[f][1]);
    CHECK_FALSE(encloses_volume(faulty));
    faulty.faces.erase(faulty.faces.begin() + static_cast<std::ptrdiff_t>(f));
    CHECK_FALSE(encloses_volume(faulty));
    CHECK_FALSE(encloses_volume(both(body, faulty)));
    faulty.faces.push_back(body.faces[f]);
    CHECK(encloses_volume(faulty));
    faulty.faces.push_back(body.faces[f]);
    CHECK_FALSE(encloses_volume(faulty));
  }
  // Closed, but without an inside: a sheet and its back.
  const TriangleMesh sheet{.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
                           .faces = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}};
  CHECK_FALSE(encloses_volume(sheet));
  CHECK_FALSE(encloses_volume(turned(sheet)));
}
