#include <ensonify/engine/seafloor/bed/tessellate.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <Eigen/Geometry>

#include "engine/seafloor/spectrum.h"
#include "support/catch.h"

using namespace ensonify::engine;
using namespace ensonify::tests;
using ensonify::refine::Face;
using ensonify::refine::MeshError;
using ensonify::refine::TriangleMesh;

namespace {

constexpr double hole = std::numeric_limits<double>::quiet_NaN();

Eigen::Vector3d normal(const TriangleMesh& mesh, const Face& face) {
  const Eigen::Vector3d a = mesh.positions[face[0]].cast<double>();
  return 0.5 * (mesh.positions[face[1]].cast<double>() - a)
                   .cross(mesh.positions[face[2]].cast<double>() - a);
}

bool has_face(const TriangleMesh& mesh, Face wanted) {
  std::sort(wanted.begin(), wanted.end());
  return std::any_of(mesh.faces.begin(), mesh.faces.end(), [&](Face face) {
    std::sort(face.begin(), face.end());
    return face == wanted;
  });
}

}  // namespace

TEST_CASE("A grid becomes two faces per cell that face upwards and cover its area once") {
  Heightfield field = flat(23, 11, 0.5, 0.8);
  field.world_origin = {1e6, 2e6, 3.0};
  for (int row = 0; row < 11; ++row)
    for (int column = 0; column < 23; ++column)
      field.at(column, row) = -5.0 + std::sin(1.3 * column) + std::cos(2.1 * row * column);
  const TriangleMesh mesh = tessellate(field);
  CHECK(mesh.positions.size() == 23 * 11);
  REQUIRE(mesh.faces.size() == 2 * 22 * 10);
  CHECK(mesh.world_origin == field.world_origin);
  double area_on_map = 0.0;
  for (const Face& face : mesh.faces) {
    const Eigen::Vector3d n = normal(mesh, face);
    REQUIRE(n.z() == Approx(0.5 * 0.5 * 0.8));
    area_on_map += n.z();
  }
  CHECK(area_on_map == Approx(22 * 0.5 * 10 * 0.8));
  // Row order from the south-west corner, centred on the origin.
  CHECK(mesh.positions.front() ==
        Eigen::Vector3f(-5.5f, -4.0f, static_cast<float>(field.at(0, 0))));
  CHECK(mesh.positions[1].x() == -5.0f);
  CHECK(mesh.positions[23].y() == -3.2f);
  CHECK(mesh.positions.back() == Eigen::Vector3f(5.5f, 4.0f, static_cast<float>(field.at(22, 10))));
  // Cells row by row.
  for (std::size_t cell = 0; cell < 220; ++cell)
    for (const Face& face : {mesh.faces[2 * cell], mesh.faces[2 * cell + 1]})
      for (const std::uint32_t vertex : face) {
        const std::size_t row = vertex / 23, column = vertex % 23;
        REQUIRE((row == cell / 22 || row == cell / 22 + 1));
        REQUIRE((column == cell % 22 || column == cell % 22 + 1));
      }
  const auto summary = summarise(mesh);
  CHECK(summary.boundary_edges == 2 * (22 + 10));
  CHECK(summary.non_manifold_edges == 0);
}

TEST_CASE("A cell is split along the diagonal that is shorter in space") {
  Heightfield field = flat(2, 2, 1.0, 1.0);       // vertices 0 south-west, 1 south-east, 2, 3 north
  CHECK(has_face(tessellate(field), {0, 1, 3}));  // a tie: from south-west to north-east
  CHECK(has_face(tessellate(field), {0, 3, 2}));
  field.z_m = {1.0, 0.0, 0.0, 0.0};
  CHECK(has_face(tessellate(field), {0, 1, 2}));
  CHECK(has_face(tessellate(field), {1, 3, 2}));
  field.z_m = {0.0, 0.0, 1.0, 0.0};
  CHECK(has_face(tessellate(field), {0, 1, 3}));
}

TEST_CASE("Cells with a hole at a corner are left out, and so are points that belong to no cell") {
  Heightfield field = flat(5, 4, 1.0, 1.0);
  for (std::size_t i = 0; i < field.z_m.size(); ++i) field.z_m[i] = -static_cast<double>(i);
  field.at(1, 1) = hole;  // removes four cells, and with them all cells of three more points
  const TriangleMesh mesh = tessellate(field);
  CHECK(mesh.faces.size() == 2 * (12 - 4));
  CHECK(mesh.positions.size() == 20 - 4);
  std::set<std::uint32_t> used;
  for (const Face& face : mesh.faces) {
    CHECK(normal(mesh, face).z() == Approx(0.5));
    used.insert(face.begin(), face.end());
  }
  CHECK(used.size() == mesh.positions.size());
  const auto at = [&](float x, float y) {
    return std::any_of(mesh.positions.begin(), mesh.positions.end(),
                       [&](const Eigen::Vector3f& p) { return p.x() == x && p.y() == y; });
  };
  for (const float x : {-2.0f, -1.0f})
    for (const float y : {-1.5f, -0.5f}) CHECK_FALSE(at(x, y));
  CHECK(at(0.0f, -1.5f));
  CHECK(at(-2.0f, 0.5f));
}

TEST_CASE(
    "A grid without a whole cell, or with heights beyond the range of a float, makes no mesh") {
  Heightfield field = flat(4, 3, 1.0, 1.0);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      if ((row + column) % 2 == 0) field.at(column, row) = hole;
  CHECK_THROWS_AS(tessellate(field), MeshError);
  CHECK_THROWS_AS(tessellate(Heightfield{}), MeshError);
  for (const double height : {1e300, std::numeric_limits<double>::infinity()}) {
    Heightfield high = flat(3, 3, 1.0, 1.0);
    high.at(1, 1) = height;
    CHECK_THROWS_AS(tessellate(high), MeshError);
  }
}
