// The contract of every intersector.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include <Eigen/Geometry>

#include "support/catch.h"
#include "support/meshes.h"
#include "support/paths.h"

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/echo/ray_layout.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/refine/parallel_for.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;

namespace {

//   y
//   1  c
//      | \        one face in the plane z = 0
//   0  a---b  x
//      0   1
refine::TriangleMesh one_face() {
  return {.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .faces = {{0, 1, 2}}};
}

/// A fan of one ray, which begins at the given ray's t_min.
RayFan fan_of(const Ray& ray) {
  static const auto one_ray = [] {
    FanGrid grid(FanLayout{.sector_high_rad = 1.0, .truncation_rad = 1.0, .main_lobe_rad = 1.0});
    grid.planes = {{0.0, 1.0, 1.0}};
    grid.elevation_rad = {0.0};
    grid.sin_elevation = {0.0};
    grid.cos_elevation = {1.0};
    return std::make_shared<const FanGrid>(std::move(grid));
  }();
  const Vector3d middle = ray.direction.stableNormalized();
  const Vector3d along = middle.unitOrthogonal();
  return {one_ray,
          ray.origin + ray.t_min * ray.direction,
          along,
          middle,
          along.cross(middle),
          (ray.t_max - ray.t_min) * ray.direction.stableNorm()};
}

/// Traces one ray; as a fan of one ray if the back-end takes only fans.
Hit shoot(const Intersector& tracer, const Ray& ray) {
  Hit hit;
  try {
    tracer.intersect({&ray, 1}, {&hit, 1});
  } catch (const std::invalid_argument& error) {
    if (std::string_view(error.what()).find("fans only") == std::string_view::npos) throw;
    check_ray(ray);
    tracer.intersect(fan_of(ray), {&hit, 1});
    if (hit) hit.t = ray.t_min + hit.t / ray.direction.stableNorm();
  }
  return hit;
}

/// Whether a back-end promises that no ray slips through, and that around an edge or a corner
/// exactly one face is hit.
bool holds_everything(std::string_view kind) {
  return kind == "pluecker" || kind == "brute_force" || kind == "fan_scan";
}
bool parts_edges(std::string_view kind) { return kind == "pluecker" || kind == "brute_force"; }

template <class F>
void for_every_intersector(const refine::TriangleMesh& mesh, F&& check) {
  for (const IntersectorKind& kind : intersector_kinds()) {
    CAPTURE(std::string(kind.name));
    check(*make_intersector(kind.name, mesh));
  }
}

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();
constexpr float no_end = std::numeric_limits<float>::infinity();

}  // namespace

TEST_CASE("a face is hit from both sides, at the right distance and place") {
  const refine::TriangleMesh mesh = one_face();
  for_every_intersector(mesh, [](const Intersector& tracer) {
    // The face lies in the plane z = 0. The ray begins 2 above it or 2 below it, and runs straight
    // towards it.
    for (const double side : {1.0, -1.0}) {
      const Hit hit = shoot(tracer, {{0.25, 0.5, 2.0 * side}, {0, 0, -side}});
      REQUIRE(hit);
      CHECK(hit.face == 0);
      CHECK(hit.t == Approx(2.0));
      CHECK(hit.u == Approx(0.25));
      CHECK(hit.v == Approx(0.5));
    }
    CHECK(!shoot(tracer, {{0.6, 0.6, 2.0}, {0, 0, -1}}));  // misses the face
    CHECK(!shoot(tracer, {{0.2, 0.2, 2.0}, {0, 0, 1}}));   // behind the origin
  });
}

TEST_CASE("distance is in units of the direction's length, within the ray's ends") {
  const refine::TriangleMesh mesh = one_face();
  for_every_intersector(mesh, [](const Intersector& tracer) {
    CHECK(shoot(tracer, {{0.2, 0.2, 2.0}, {0, 0, -4}}).t == Approx(0.5));
    CHECK(!shoot(tracer, {{0.2, 0.2, 2.0}, {0, 0, -1}, 0.0, 1.9}));
    CHECK(!shoot(tracer, {{0.2, 0.2, 2.0}, {0, 0, -1}, 2.1, 9.0}));
    CHECK(shoot(tracer, {{0.2, 0.2, 2.0}, {0, 0, -1}, 1.9, 2.1}));
    CHECK(shoot(tracer, {{0.25, 0.25, 2.0}, {0, 0, -1}, 2.0, 2.5}));  // both ends are included
    CHECK(shoot(tracer, {{0.25, 0.25, 2.0}, {0, 0, -1}, 1.5, 2.0}));
    CHECK(shoot(tracer, {{0.25, 0.25, 2.0}, {0, 0, -1}, 2.0, 2.0}));
  });
}

TEST_CASE("a ray that starts on a face hits it at t = 0, or what comes after its t_min") {
  refine::TriangleMesh mesh = one_face();
  for (const Eigen::Vector3f& p : one_face().positions)
    mesh.positions.emplace_back(p - Eigen::Vector3f(0, 0, 3));
  mesh.faces.push_back({3, 4, 5});
  for_every_intersector(mesh, [](const Intersector& tracer) {
    // ----o----  z = 0
    //     |
    // ----v----  z = -3
    const Hit at_once = shoot(tracer, {{0.25, 0.25, 0.0}, {0, 0, -1}});
    REQUIRE(at_once);
    CHECK(at_once.face == 0);
    CHECK(at_once.t == 0.0);
    const Hit after = shoot(tracer, {{0.25, 0.25, 0.0}, {0, 0, -1}, 0.5});
    REQUIRE(after);
    CHECK(after.face == 1);
    CHECK(after.t == Approx(3.0));
  });
}

TEST_CASE("a ray in a face's plane never hits it") {
  const refine::TriangleMesh mesh = one_face();
  for_every_intersector(mesh, [](const Intersector& tracer) {
    //   c
    //   |.\          along edges, through corners and the middle, starting outside it and on it
    //   | .\ .
    // o-a--b->
    for (const Vector3d& origin : {Vector3d(-1, 0, 0), Vector3d(0, 0, 0), Vector3d(0.25, 0.25, 0)})
      for (const Vector3d& direction :
           {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(1, 0.25, 0), Vector3d(-1, 1, 0)})
        CHECK(!shoot(tracer, {origin, direction}));
    CHECK(!shoot(tracer, {{-1, 0.25, 1e-3}, {1, 0, 0}}));  // just above the plane
  });
}

TEST_CASE("a single face is hit up to its edges and not beyond them") {
  const refine::TriangleMesh mesh = one_face();
  for_every_intersector(mesh, [](const Intersector& tracer) {
    //   c
    //   |.\ .       slightly to either side of an edge or a corner
    //   | .\ .
    //   a-----b
    constexpr double little = 1e-5;
    for (const double side : {1.0, -1.0})
      for (const Vector3d& edge : {Vector3d(0.5, 0, 0), Vector3d(0, 0.5, 0), Vector3d(0.5, 0.5, 0),
                                   Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 1, 0)}) {
        const Vector3d inwards = (Vector3d(0.25, 0.25, 0) - edge) * little;
        const Vector3d above(0, 0, 2.0 * side), down(0, 0, -side);
        const Hit hit = shoot(tracer, {edge + inwards + above, down});
        REQUIRE(hit);
        CHECK((hit.u >= 0.0 && hit.v >= 0.0 && hit.u + hit.v <= 1.0 + 1e-6));
        CHECK(hit.u == Approx((edge + inwards).x()).margin(1e-6));
        CHECK(hit.v == Approx((edge + inwards).y()).margin(1e-6));
        CHECK(!shoot(tracer, {edge - inwards + above, down}));
        const Hit on_it = shoot(tracer, {edge + above, down});  // decided by the tie rule
        if (on_it) CHECK(on_it.t == Approx(2.0));
      }
  });
}

TEST_CASE("around a corner and along the edges that meet there a ray hits one face") {
  //   3---2---1
  //   | \ | / |     eight faces around 0; the ray goes down through 0, through an edge's middle, or
  //   4---0---8     along an edge's line on its way to one of them
  //   | / | \ |
  //   5---6---7
  const refine::TriangleMesh mesh{
      .positions = {{0, 0, 0},
                    {1, 1, 0},
                    {0, 1, 0},
                    {-1, 1, 0},
                    {-1, 0, 0},
                    {-1, -1, 0},
                    {0, -1, 0},
                    {1, -1, 0},
                    {1, 0, 0}},
      .faces = {
          {0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {0, 5, 6}, {0, 6, 7}, {0, 7, 8}, {0, 8, 1}}};
  for (const IntersectorKind& kind : intersector_kinds()) {
    CAPTURE(std::string(kind.name));
    const auto tracer = make_intersector(kind.name, mesh);
    std::vector<std::unique_ptr<Intersector>> alone;
    for (const refine::Face& face : mesh.faces)
      alone.push_back(make_intersector(kind.name, {mesh.positions, {&face, 1}}));
    for (const Eigen::Vector3f& vertex : mesh.positions)
      for (const Vector3d& from :
           {Vector3d(0, 0, 4), Vector3d(0, 0, -4), Vector3d(2, 0, 4), Vector3d(-3, 3, 4)}) {
        const Vector3d target = 0.5 * vertex.cast<double>();
        const Ray ray{target + from, -from};
        const Hit hit = shoot(*tracer, ray);
        REQUIRE(hit);
        CHECK(hit.t == Approx(1.0));
        int faces = 0;
        for (const auto& face : alone) faces += static_cast<bool>(shoot(*face, ray));
        if (parts_edges(kind.name)) CHECK(faces == 1);
      }
  }
}

TEST_CASE("of faces at one place the lowest is hit, in any orientation") {
  refine::TriangleMesh mesh = one_face();
  for (float z : {-1.0f, 1.0f})
    for (const Eigen::Vector3f& p : one_face().positions)
      mesh.positions.emplace_back(p + Eigen::Vector3f(0, 0, z));
  // z = 0 three times, above it z = 1 three times, one of each upside down
  mesh.faces = {{3, 4, 5}, {6, 7, 8}, {0, 1, 2}, {7, 6, 8}, {0, 1, 2}, {1, 0, 2}, {6, 7, 8}};
  for_every_intersector(mesh, [](const Intersector& tracer) {
    CHECK(shoot(tracer, {{0.25, 0.25, 5.0}, {0, 0, -1}}).face == 1);
    CHECK(shoot(tracer, {{0.25, 0.25, 0.5}, {0, 0, -1}}).face == 2);
    CHECK(shoot(tracer, {{0.25, 0.25, -5.0}, {0, 0, 1}}).face == 0);
  });
}

TEST_CASE("of several faces the nearest is hit") {
  refine::TriangleMesh mesh = one_face();
  for (float z : {-1.0f, 1.0f}) {
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    for (int i = 0; i < 3; ++i)
      mesh.positions.emplace_back(mesh.positions[i] + Eigen::Vector3f(0, 0, z));
    mesh.faces.push_back({n, n + 1, n + 2});
  }
  for_every_intersector(mesh, [](const Intersector& tracer) {
    CHECK(shoot(tracer, {{0.2, 0.2, 5.0}, {0, 0, -1}}).face == 2);
    CHECK(shoot(tracer, {{0.2, 0.2, -5.0}, {0, 0, 1}}).face == 1);
  });
}

TEST_CASE("the order of faces and vertices does not change a hit, to the bit") {
  // Steep relief seen from a low height, so that many rays pass a ridge or an edge; every third
  // face is there twice, and some faces lie within others.
  refine::TriangleMesh mesh = tests::open_grid(40, 40, 0.5, 1.0, 11);
  const std::size_t plain = mesh.faces.size();
  for (std::size_t i = 0; i < plain; i += 3)
    mesh.faces.push_back({mesh.faces[i][1], mesh.faces[i][2], mesh.faces[i][0]});
  for (std::size_t i = 0; i < plain; i += 7) {
    const refine::Face face = mesh.faces[i];
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int k = 0; k < 3; ++k)
      mesh.positions.emplace_back(0.5f *
                                  (mesh.positions[face[k]] + mesh.positions[face[(k + 1) % 3]]));
    mesh.faces.push_back({first, first + 1, first + 2});
  }

  std::mt19937 random(5);
  std::vector<std::uint32_t> vertex_order(mesh.positions.size()), numbers(mesh.faces.size());
  std::iota(vertex_order.begin(), vertex_order.end(), 0u);
  std::iota(numbers.begin(), numbers.end(), 0u);
  std::shuffle(vertex_order.begin(), vertex_order.end(), random);
  std::shuffle(numbers.begin(), numbers.end(), random);
  refine::TriangleMesh shuffled;
  shuffled.positions.resize(mesh.positions.size());
  for (std::size_t i = 0; i < vertex_order.size(); ++i)
    shuffled.positions[vertex_order[i]] = mesh.positions[i];
  for (const std::uint32_t number : numbers) {
    const refine::Face& face = mesh.faces[number];
    shuffled.faces.push_back({vertex_order[face[0]], vertex_order[face[1]], vertex_order[face[2]]});
  }

  const refine::Bounds box = refine::bounds(mesh);
  const Vector3d middle = 0.5 * (box.lowest + box.highest).cast<double>();
  const auto grid = std::make_shared<const FanGrid>(FanLayout{.sector_low_rad = -0.1,
                                                              .sector_high_rad = 1.5,
                                                              .truncation_rad = 0.5,
                                                              .main_lobe_rad = 0.5,
                                                              .planes = 24,
                                                              .elevations = 1500});
  std::vector<Hit> expected(grid->rays()), found(grid->rays());
  for (const IntersectorKind& kind : intersector_kinds()) {
    CAPTURE(std::string(kind.name));
    const auto one = make_intersector(kind.name, mesh);
    const auto other = make_intersector(kind.name, {shuffled.positions, shuffled.faces, numbers});
    std::size_t hits = 0, differences = 0;
    // Without a tree every ray tests every face: one fan is enough then.
    const std::vector<double> turns =
        kind.name == "brute_force" ? std::vector{0.3} : std::vector{0.3, 1.1, 2.0, 4.4};
    for (const double turn : turns) {
      const Eigen::AngleAxisd about(turn, Vector3d::UnitZ());
      const Vector3d along = about * Vector3d::UnitX(), across = about * Vector3d::UnitY();
      const RayFan fan{grid,
                       middle - 9.0 * across + 3.0 * Vector3d::UnitZ(),
                       along,
                       (across - Vector3d::UnitZ()).normalized(),
                       (across + Vector3d::UnitZ()).normalized(),
                       60.0};
      one->intersect(fan, expected);
      other->intersect(fan, found);
      for (std::size_t i = 0; i < found.size(); ++i) {
        hits += static_cast<bool>(expected[i]);
        differences += found[i].face != expected[i].face || found[i].t != expected[i].t ||
                       found[i].u != expected[i].u || found[i].v != expected[i].v;
      }
    }
    CHECK(hits > 5000 * turns.size());
    CHECK(differences == 0);
  }
}

TEST_CASE("rays miss an empty mesh and a face without area") {
  const refine::TriangleMesh empty;
  for_every_intersector(empty, [](const Intersector& tracer) {
    CHECK(!shoot(tracer, {{0, 0, 1}, {0, 0, -1}}));
  });
  const refine::TriangleMesh needle{.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}},
                                    .faces = {{0, 1, 2}, {0, 0, 1}, {1, 1, 1}}};
  for_every_intersector(needle, [](const Intersector& tracer) {
    for (const double x : {0.0, 0.5, 1.0}) CHECK(!shoot(tracer, {{x, 0, 1}, {0, 0, -1}}));
  });
}

TEST_CASE("rays and vertices that are not finite, or huge, are refused") {
  const refine::TriangleMesh mesh = one_face();
  for_every_intersector(mesh, [](const Intersector& tracer) {
    for (const double bad : {not_a_number, inf, -inf, 1e25, -1e38, 1e300})
      for (int axis = 0; axis < 3; ++axis) {
        Ray origin{{0.25, 0.25, 1}, {0, 0, -1}}, direction = origin;
        origin.origin[axis] = bad, direction.direction[axis] = bad;
        CHECK_THROWS_AS(shoot(tracer, origin), std::invalid_argument);
        RayFan fan = fan_of({{0.25, 0.25, 1}, {0, 0, -1}});
        fan.origin[axis] = bad;
        std::vector<Hit> hits(fan.grid->rays());
        CHECK_THROWS_AS(tracer.intersect(fan, hits), std::invalid_argument);
        CHECK_THROWS_AS(shoot(tracer, direction), std::invalid_argument);
        CHECK_THROWS_AS(shoot(tracer, {{0, 0, 0}, {0, 0, 1}, bad, inf}), std::invalid_argument);
      }
    CHECK_THROWS_AS(shoot(tracer, {{0, 0, 0}, {0, 0, 1}, -1.0, inf}), std::invalid_argument);
    CHECK_THROWS_AS(shoot(tracer, {{0, 0, 0}, {0, 0, 1}, 0.0, not_a_number}),
                    std::invalid_argument);
    CHECK_THROWS_AS(shoot(tracer, {{0, 0, 0}, {0, 0, 0}}), std::invalid_argument);
    CHECK_THROWS_AS(shoot(tracer, {{0, 0, 0}, {0, 0, 1}, 1.0, 0.5}), std::invalid_argument);
    CHECK(!shoot(tracer, {{0.2, 0.2, 1}, {0, 0, 1e-40}}));  // denormal, and allowed
    CHECK(!shoot(tracer, {{0.2, 0.2, 1}, {0, 0, 5e-324}}));
    CHECK(!shoot(tracer, {{1e18, -1e18, 1e18}, {1e18, 0, 0}}));
    CHECK(shoot(tracer, {{0.25, 0.25, 1}, {0, -1e-310, -1}}));
    CHECK(shoot(tracer, {{0.25, 0.25, 1}, {-0.0, -0.0, -1}, 0.0, 1e300}));
  });
  for (const float bad : {std::nanf(""), no_end, -no_end, 1e38f, -1e38f})
    for (int axis = 0; axis < 3; ++axis) {
      refine::TriangleMesh broken = one_face();
      broken.positions[1][axis] = bad;
      for (const IntersectorKind& kind : intersector_kinds())
        CHECK_THROWS_AS(make_intersector(kind.name, broken), refine::MeshError);
    }
}

TEST_CASE("a face with denormal corners is like any other, or too small to be hit") {
  constexpr float tiny = std::numeric_limits<float>::denorm_min();
  const refine::TriangleMesh mesh{
      .positions = {{0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}, {4, tiny, 0}},
      .faces = {{0, 1, 2}, {0, 1, 3}}};
  for_every_intersector(mesh, [](const Intersector& tracer) {
    const Hit hit = shoot(tracer, {{0, 0, 1}, {0, 0, -1}});
    if (hit) CHECK(hit.t == Approx(1.0));
    CHECK(!shoot(tracer, {{1, 1, 1}, {0, 0, -1}}));
  });
}

TEST_CASE(
    "an intersector can be built again with more or fewer triangles, and forgets the old ones") {
  const refine::TriangleMesh one = one_face(), empty;
  refine::TriangleMesh two = one_face();
  for (Eigen::Vector3f& p : two.positions) p.x() += 5.0f;
  two.positions.emplace_back(6, 1, 0);
  two.faces.push_back({1, 3, 2});
  const Ray on_one{{0.25, 0.25, 1}, {0, 0, -1}}, on_two{{5.75, 0.75, 1}, {0, 0, -1}};
  for (const IntersectorKind& kind : intersector_kinds())
    for (const bool for_one_ping : {false, true}) {
      CAPTURE(std::string(kind.name), for_one_ping);
      const auto tracer = kind.make({.for_one_ping = for_one_ping});
      for (int turn = 0; turn < 3; ++turn) {
        tracer->build(one);
        CHECK(shoot(*tracer, on_one).face == 0);
        CHECK(!shoot(*tracer, on_two));
        tracer->build(two);
        CHECK(!shoot(*tracer, on_one));
        CHECK(shoot(*tracer, on_two).face == 1);
        tracer->build(empty);
        CHECK(!shoot(*tracer, on_one));
        CHECK(!shoot(*tracer, on_two));
      }
    }
}

namespace {

/// A ball of 8 n^2 faces: an octahedron's sides divided into n^2 each, projected to a sphere.
refine::TriangleMesh ball(int n, const Vector3d& middle, double radius_m) {
  refine::TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> numbers;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [found, is_new] =
        numbers.emplace(at, static_cast<std::uint32_t>(mesh.positions.size()));
    if (is_new) {
      const Vector3d p = Vector3d(at[0], at[1], at[2]).normalized() * radius_m + middle;
      mesh.positions.emplace_back(p.cast<float>());
    }
    return found->second;
  };
  for (int octant = 0; octant < 8; ++octant)
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n - i; ++j) {
        const auto at = [&](int x, int y) {
          return vertex(
              {octant & 1 ? -x : x, octant & 2 ? -y : y, octant & 4 ? -(n - x - y) : n - x - y});
        };
        mesh.faces.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
        if (j < n - i - 1) mesh.faces.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
      }
  return mesh;
}

enum class Aim { vertex, edge, face };

/// The point of a face that rays are aimed at.
Vector3d point_of(const refine::Triangles& mesh, std::uint32_t face, Aim aim) {
  if (aim == Aim::vertex) return mesh.corner(face, 0);
  const Vector3d a = mesh.corner(face, 0), b = mesh.corner(face, 1), c = mesh.corner(face, 2);
  return aim == Aim::edge ? Vector3d(0.5 * (a + b)) : Vector3d(0.5 * a + 0.3 * b + 0.2 * c);
}

}  // namespace

//      .--.
//   --x----x->      from outside in and out again, then nothing
//    ( o----x->     from inside out once
//      `--'
TEST_CASE(
    "a sphere of 1e5 faces far from the origin is closed to all rays, except Embree's leaks") {
  const Vector3d middle(148376, 1234, -223423);
  constexpr double radius_m = 100.0;
  const refine::TriangleMesh mesh = ball(112, middle, radius_m);
  REQUIRE(mesh.faces.size() > 100000);
  for (const IntersectorKind& kind : intersector_kinds()) {
    CAPTURE(std::string(kind.name));
    const auto tracer = make_intersector(kind.name, mesh);
    const int rays = kind.name == "brute_force" ? 30 : 5000;
    for (const Aim aim : {Aim::vertex, Aim::edge, Aim::face}) {
      std::mt19937 random(1);
      std::uniform_int_distribution<std::uint32_t> any_face(
          0, static_cast<std::uint32_t>(mesh.faces.size() - 1));
      std::uniform_real_distribution<double> offset(-30.0, 30.0);
      int leaks = 0;
      for (int i = 0; i < rays; ++i) {
        const bool outside = i % 2;
        const Vector3d target = point_of(mesh, any_face(random), aim);
        const Vector3d inside =
            middle + Vector3d::NullaryExpr([&] { return std::round(offset(random)); });
        const Vector3d outwards = (target - inside).normalized();
        const Ray ray = outside ? Ray{target + 300.0 * outwards, -outwards} : Ray{inside, outwards};
        const Hit first = shoot(*tracer, ray);
        const Hit second = shoot(*tracer, {ray.origin, ray.direction, first ? first.t + 1.0 : 0.0});
        const bool right = first && static_cast<bool>(second) == outside;
        leaks += !right;
        if (!right) continue;
        REQUIRE(std::abs(first.t - (target - ray.origin).norm()) < 0.05);
        if (!outside) continue;
        REQUIRE(!shoot(*tracer, {ray.origin, ray.direction, second.t + 1.0}));
        REQUIRE(std::abs((ray.origin + second.t * ray.direction - middle).norm() - radius_m) < 0.1);
      }
      CAPTURE(static_cast<int>(aim), leaks);
      CHECK(leaks <= (holds_everything(kind.name) || aim == Aim::face ? 0 : rays / 100));
    }
  }
}

TEST_CASE("a fan's answers are those of its single rays, and misses outside the beam") {
  const auto grid = std::make_shared<const FanGrid>(FanLayout{.sector_low_rad = 0.1,
                                                              .sector_high_rad = 1.4,
                                                              .truncation_rad = 0.02,
                                                              .main_lobe_rad = 0.01,
                                                              .elevations = 101});
  refine::TriangleMesh mesh = ball(16, {0, 0, 0}, 50.0);
  const Vector3d down(0, std::cos(grid->middle_depression_rad),
                      -std::sin(grid->middle_depression_rad));
  const RayFan fan{grid, {1, 2, 3}, Vector3d::UnitX(), down, Vector3d::UnitX().cross(down), 49.0};
  for_every_intersector(mesh, [&](const Intersector& tracer) {
    std::vector<Hit> hits(grid->rays());
    tracer.intersect(fan, hits);
    std::size_t met = 0, beyond = 0;
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation) {
        const Hit& hit = hits[plane * fan.elevations() + elevation];
        if (!grid->within_beam(plane, elevation)) {
          ++beyond;
          REQUIRE(!hit);
          continue;
        }
        const Hit alone = shoot(tracer, fan.ray(plane, elevation));
        met += static_cast<bool>(hit);
        REQUIRE(hit.face == alone.face);
        if (hit) REQUIRE(hit.t == Approx(alone.t).epsilon(1e-6));
      }
    CHECK(met > 500);
    CHECK(met + beyond < grid->rays());  // some end before the sphere
    CHECK(beyond > 0);
  });
}

TEST_CASE("an unknown intersector is refused with the known names") {
  const refine::TriangleMesh mesh = one_face();
  CHECK_THROWS_WITH(make_intersector("embre", mesh),
                    Catch::Contains("embree") && Catch::Contains("pluecker, brute_force"));
}

namespace {

struct Agreement {
  std::size_t rays = 0, hits = 0, other_face = 0, leaks = 0, unexplained = 0;
  double largest_relative = 0.0;
};

/// Whether the ray passes an edge of the face within a millionth of its range.
bool at_an_edge(const refine::TriangleMesh& mesh, const Ray& ray, const Hit& hit) {
  const refine::Triangles triangles = mesh;
  const Vector3d p = ray.origin + hit.t * ray.direction;
  for (int k = 0; k < 3; ++k) {
    const Vector3d a = triangles.corner(hit.face, k), b = triangles.corner(hit.face, (k + 1) % 3);
    const double along = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    if ((p - a - along * (b - a)).norm() <= 1e-6 * hit.t) return true;
  }
  return false;
}

void compare(const refine::TriangleMesh& mesh, const RayFan& fan, std::span<const Hit> found,
             std::span<const Hit> reference, Agreement& count) {
  for (std::size_t ray = 0; ray < found.size(); ++ray) {
    const std::size_t plane = ray / fan.elevations(), elevation = ray % fan.elevations();
    if (!fan.grid->within_beam(plane, elevation)) continue;
    ++count.rays;
    const Hit &a = found[ray], &b = reference[ray];
    count.hits += static_cast<bool>(b);
    if (!a && !b) continue;
    const double relative = a && b ? std::abs(a.t - b.t) / b.t : 1.0;
    if (relative <= 1e-5) {
      count.largest_relative = std::max(count.largest_relative, relative);
      count.other_face += a.face != b.face;
    } else if (at_an_edge(mesh, fan.ray(plane, elevation), a && (!b || a.t < b.t) ? a : b)) {
      ++count.leaks;
    } else {
      ++count.unexplained;
    }
  }
}

/// Compares embree with pluecker on fans of a scene's pings, which turn, roll and advance.
Agreement compare_over(const Scene& scene, int pings) {
  const Seafloor bed = make_seafloor(scene.seafloor, scene.seed);
  const Sonar& sonar = scene.sonars.front();
  const double altitude_m = scene.track.altitude_m;
  const RayLayout layout =
      make_ray_layout(sonar, 1500.0 / sonar.frequency_hz, sonar.range_m / altitude_m);
  const auto embree = make_intersector("embree", bed.mesh);
  const auto pluecker = make_intersector("pluecker", bed.mesh);
  std::vector<Agreement> counts(2 * static_cast<std::size_t>(pings));
  refine::parallel_for(counts.size(), 2, [&](std::size_t item, int) {
    const std::size_t ping = item / 2;
    const double step = static_cast<double>(ping);
    const Pose pose{.position = {0.3 * step, 0.17 * step, altitude_m - scene.seafloor.depth_m},
                    .roll_rad = 0.02 * step,
                    .heading_rad = 0.4 * step};
    const RayFan fan =
        place_fan(layout, pose, item % 2 ? starboard_sector : port_sector, sonar.range_m);
    std::vector<Hit> found(fan.grid->rays()), expected(fan.grid->rays());
    embree->intersect(fan, found);
    pluecker->intersect(fan, expected);
    compare(bed.mesh, fan, found, expected, counts[item]);
  });
  Agreement sum;
  for (const Agreement& one : counts) {
    sum.rays += one.rays;
    sum.hits += one.hits;
    sum.other_face += one.other_face;
    sum.leaks += one.leaks;
    sum.unexplained += one.unexplained;
    sum.largest_relative = std::max(sum.largest_relative, one.largest_relative);
  }
  return sum;
}

Scene ripples_scene() { return read_scene(tests::source_folder() / "scenes/ripples.toml"); }

}  // namespace

TEST_CASE("embree hits what pluecker hits: 1e5 rays of the ripples scene, except leaks along edges",
          "[slow]") {
  const Agreement count = compare_over(ripples_scene(), 4);
  INFO(count.rays << " rays, " << count.hits << " hits, " << count.other_face
                  << " on a neighbour at the same distance, " << count.leaks
                  << " leaks along an edge, largest relative difference "
                  << count.largest_relative);
  CHECK(count.rays >= 100000);
  CHECK(count.hits > count.rays / 2);
  CHECK(count.unexplained == 0);
  CHECK(count.leaks <= count.rays / 10000);
  CHECK(count.largest_relative <= 1e-5);
}

TEST_CASE("embree hits what pluecker hits on 3e6 rays of the ripples scene", "[.][soak]") {
  const Agreement count = compare_over(ripples_scene(), 90);
  WARN(count.rays << " rays, " << count.hits << " hits, " << count.other_face
                  << " on a neighbour at the same distance, " << count.leaks
                  << " leaks along an edge, largest relative difference "
                  << count.largest_relative);
  CHECK(count.unexplained == 0);
}
