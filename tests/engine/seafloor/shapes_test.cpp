#include <ensonify/engine/seafloor/objects/shapes.h>

#include <map>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <Eigen/Geometry>

#include "support/body.h"
#include "support/catch.h"

#include <ensonify/refine/mesh_repair.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;
using ensonify::tests::body;
using std::numbers::pi;

namespace {

double volume_m3(const refine::TriangleMesh& mesh) {
  const refine::Triangles triangles = mesh;
  double volume = 0.0;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    volume +=
        triangles.corner(f, 0).dot(triangles.corner(f, 1).cross(triangles.corner(f, 2))) / 6.0;
  return volume;
}

refine::TriangleMesh line(std::string_view name, const ShapeSize& size = {}) {
  return make_line(shape_named(name), size,
                   std::vector<Vector3d>{{0, 0, 0}, {0, 4, 0}, {1, 7, 0.3}, {3, 8, 0}})
      .in_floats();
}

refine::TriangleMesh any(const ShapeKind& kind) {
  return kind.along_path ? line(kind.name) : body(kind.name);
}

Vector3d size_of(const refine::TriangleMesh& mesh) {
  const refine::Bounds box = refine::bounds(mesh);
  return (box.highest - box.lowest).cast<double>();
}

}  // namespace

TEST_CASE("Every shape is closed and manifold with normals outwards, and needs no repair") {
  for (const ShapeKind& kind : shape_kinds()) {
    CAPTURE(kind.name);
    const refine::TriangleMesh mesh = any(kind);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const refine::Face& face : mesh.faces)
      for (std::size_t k = 0; k < 3; ++k) ++edges[{face[k], face[(k + 1) % 3]}];
    for (const auto& [edge, count] : edges) {
      REQUIRE(count == 1);
      REQUIRE(edges.count({edge.second, edge.first}) == 1);
    }
    const refine::RepairedMesh repaired = refine::repair(mesh, -1.0);
    CHECK(repaired.report.total() == 0);  // a component with normals inwards would be flipped
    CHECK(volume_m3(mesh) > 0.0);
    CHECK(refine::encloses_volume(mesh));
    CHECK(mesh.faces.size() < 50000);
  }
}

TEST_CASE("A shape has the given sizes along its heading, across it and upwards") {
  ShapeSize size;
  size.length_m = 3.0;
  size.width_m = 1.5;
  size.shape_height_m = 0.75;
  for (const std::string_view name : {"box", "wedge", "pot"}) {
    CAPTURE(name);
    CHECK((size_of(body(name, size)) - Vector3d(1.5, 3.0, 0.75)).norm() < 0.04);
  }
  size.diameter_m = 0.8;
  CHECK((size_of(body("cylinder", size)) - Vector3d(0.8, 3.0, 0.8)).norm() < 0.01);
  CHECK((size_of(body("barrel", size)) - Vector3d(0.8, 3.0, 0.8)).norm() < 0.01);
  CHECK((size_of(body("cone", size)) - Vector3d(0.8, 0.8, 0.75)).norm() < 0.01);
  CHECK((size_of(body("sphere", size)) - Vector3d(0.8, 0.8, 0.8)).norm() < 0.01);
  CHECK((size_of(body("tyre", size)) - Vector3d(0.8, 0.8, 0.75)).norm() < 0.03);
  CHECK((size_of(body("anchor", size)) - Vector3d(1.5, 3.0, 0.75)).norm() < 0.05);
  CHECK(size_of(body("boulder", size)).maxCoeff() <= 0.8 + 1e-6);
  CHECK(size_of(body("boulder", size)).maxCoeff() > 0.5);
  CHECK(size_of(body("debris", size)).y() <= 3.0);
}

TEST_CASE("Round shapes have the volume of the round body") {
  ShapeSize size;
  size.diameter_m = 0.6;
  size.top_diameter_m = 0.3;
  size.shape_height_m = 0.4;
  size.length_m = 2.0;
  CHECK(volume_m3(body("cylinder", size)) == Approx(pi * 0.09 * 2.0).epsilon(1e-5));
  // The volume of a frustum is pi h (R^2 + R r + r^2) / 3.
  CHECK(volume_m3(body("cone", size)) ==
        Approx(pi * 0.4 * (0.09 + 0.045 + 0.0225) / 3.0).epsilon(1e-5));
  CHECK(volume_m3(body("sphere", size)) == Approx(pi / 6.0 * 0.216).epsilon(0.02));
  size.facet_m = 0.01;
  CHECK(volume_m3(body("sphere", size)) == Approx(pi / 6.0 * 0.216).epsilon(0.001));
  // Mitred corners keep a tube's volume: what a corner loses inside it gains outside.
  ShapeSize pipe;
  pipe.diameter_m = 0.2;
  const double length_m = 4.0 + std::sqrt(1.0 + 9.0 + 0.09) + std::sqrt(4.0 + 1.0 + 0.09);
  CHECK(volume_m3(line("pipeline", pipe)) == Approx(pi * 0.01 * length_m).epsilon(1e-4));
}

TEST_CASE("Boulders and debris differ from one another and are the same for the same seed") {
  for (const std::string_view name : {"boulder", "debris", "net"}) {
    const ShapeKind& kind = shape_named(name);
    const auto made = [&](std::uint64_t number) {
      return make_body(kind, {}, RandomStream(1, Purpose::object_shape, {0, number}))
          .mesh.positions;
    };
    CHECK(made(1) == made(1));
    CHECK(made(1) != made(2));
  }
}

TEST_CASE("A chain's links follow one another at a distance of four rod thicknesses") {
  ShapeSize size;
  size.rod_m = 0.1;
  const ObjectMesh chain = make_line(shape_named("chain"), size,
                                     std::vector<Vector3d>{{0, 0, 0}, {0, 2, 0}, {0, 4.0001, 0}});
  const std::size_t link_faces = 14 * 8 * 2;
  CHECK(chain.faces.size() == 10 * link_faces);
}

TEST_CASE("Sizes that contradict one another, and wrong kinds of shape, are refused") {
  ShapeSize size;
  size.rod_m = 0.2;
  CHECK_THROWS_WITH(body("pot", size), Catch::Contains("cannot have a rod_m of 0.2"));
  CHECK_THROWS_AS(body("pipeline"), std::invalid_argument);
  CHECK_THROWS_AS(line("box"), std::invalid_argument);
  CHECK_THROWS_AS(shape_named("brick"), std::invalid_argument);
}
