#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include <Eigen/Geometry>

#include "support/catch.h"
#include "support/hits.h"

#include <ensonify/engine/trace/intersector.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;
using Eigen::Vector3f;
using ensonify::tests::hit_of;

namespace {

__extension__ using Wide = __int128;
using WideVector = std::array<Wide, 3>;

WideVector wide(const Vector3d& v) {
  return {static_cast<Wide>(v.x()), static_cast<Wide>(v.y()), static_cast<Wide>(v.z())};
}
WideVector operator-(const WideVector& a, const WideVector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Wide dot(const WideVector& a, const WideVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
WideVector cross(const WideVector& a, const WideVector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Whether the ray hits the face, computed in integers in another way: the ray is actually moved,
/// by (B^-1, B^-2, B^-3) with B = 2^14; the point where it meets the face's plane, times approach
/// and B^3, is tested in the face's projection on two axes. For integers below 16.
bool hit_by_moving(const refine::Triangles& mesh, std::uint32_t face, const Ray& ray) {
  constexpr Wide b = 1 << 14, unit = b * b * b;
  const WideVector a = wide(mesh.corner(face, 0));
  const WideVector ab = wide(mesh.corner(face, 1)) - a, ac = wide(mesh.corner(face, 2)) - a;
  const WideVector normal = cross(ab, ac), d = wide(ray.direction), o = wide(ray.origin);
  const Wide approach = dot(normal, d);
  if (approach == 0) return false;
  if ((dot(normal, a - o) < 0) != (approach < 0) && dot(normal, a - o) != 0)
    return false;  // behind the origin
  const std::array<Wide, 3> move{b * b, b, 1};
  WideVector to_origin, at;  // relative to a, times B^3; `at` also times approach
  for (std::size_t i = 0; i < 3; ++i) to_origin[i] = (o[i] - a[i]) * unit + move[i];
  for (std::size_t i = 0; i < 3; ++i)
    at[i] = to_origin[i] * approach - d[i] * dot(normal, to_origin);
  std::size_t dropped = 0;
  while (normal[dropped] == 0) ++dropped;
  const std::size_t j = (dropped + 1) % 3, k = (dropped + 2) % 3;
  // at = beta ab + gamma ac in the projection, all times the projection's area and approach * B^3.
  const bool flipped = (normal[dropped] < 0) != (approach < 0);
  const Wide beta = (at[j] * ac[k] - at[k] * ac[j]) * (flipped ? -1 : 1);
  const Wide gamma = (ab[j] * at[k] - ab[k] * at[j]) * (flipped ? -1 : 1);
  const Wide whole = normal[dropped] * approach * unit * (flipped ? -1 : 1);
  return beta > 0 && gamma > 0 && beta + gamma < whole;
}

int integer(std::mt19937& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}
Vector3d integers(std::mt19937& random, int below) {
  return Vector3d::NullaryExpr([&] { return integer(random, -below, below); });
}

refine::TriangleMesh integer_soup(std::mt19937& random, int vertices, int faces, int below) {
  refine::TriangleMesh mesh;
  for (int i = 0; i < vertices; ++i)
    mesh.positions.emplace_back(integers(random, below).cast<float>());
  for (int i = 0; i < faces; ++i) {
    refine::Face& face = mesh.faces.emplace_back();
    for (std::uint32_t& corner : face)
      corner = static_cast<std::uint32_t>(integer(random, 0, vertices - 1));
  }
  return mesh;
}

bool same_hit(const Hit& a, const Hit& b) {
  const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  return a.face == b.face && bits(a.t) == bits(b.t) && bits(a.u) == bits(b.u) &&
         bits(a.v) == bits(b.v);
}

}  // namespace

TEST_CASE("a face is hit as integers decide, at corners, at edges and in its plane too") {
  std::mt19937 random(1);
  std::size_t hits = 0;
  for (int scene = 0; scene < 100; ++scene) {
    const refine::TriangleMesh mesh = integer_soup(random, 12, 40, 1 + scene % 4);
    const refine::Triangles view = mesh;
    for (const std::string_view kind : {"pluecker", "brute_force"}) {
      const auto tracer = make_intersector(kind, mesh);
      for (int i = 0; i < 100; ++i) {
        Ray ray{integers(random, 4), integers(random, 3)};
        if (ray.direction.isZero(0.0)) continue;
        Hit expected;
        for (std::uint32_t face = 0; face < mesh.faces.size(); ++face) {
          if (!hit_by_moving(view, face, ray)) continue;
          const Vector3d a = view.corner(face, 0);
          const Vector3d normal = (view.corner(face, 1) - a).cross(view.corner(face, 2) - a);
          const double t = normal.dot(a - ray.origin) / normal.dot(ray.direction);
          if (t < expected.t) expected = {face, face, t};
        }
        const Hit found = hit_of(*tracer, ray);
        REQUIRE(found.face == expected.face);
        REQUIRE(found.t == expected.t);
        if (!found) continue;
        ++hits;
        REQUIRE((found.u >= 0.0 && found.v >= 0.0 && found.u + found.v <= 1.0 + 1e-15));
        const Vector3d a = view.corner(found.face, 0), b = view.corner(found.face, 1),
                       c = view.corner(found.face, 2);
        REQUIRE((a + found.u * (b - a) + found.v * (c - a) - ray.origin - found.t * ray.direction)
                    .norm() < 1e-12);
      }
    }
  }
  CHECK(hits > 2000);
}

// The boundary of random unit cubes: closed, with edges where four faces meet, all in planes of the
// grid. Each face is a separate intersector, so that all crossings count.
//
//    +--+  +--+
//    |##|  |##|      o--> along grid lines, through vertices, edges, midpoints, within faces'
//    planes
//    +--+--+--+
//       |##|
//       +--+
TEST_CASE("a ray crosses a closed surface an odd number of times from inside, else an even one") {
  std::mt19937 random(2);
  constexpr int n = 4;
  std::array<bool, n * n * n> full;
  const auto is_full = [&](const Eigen::Vector3i& c) {
    return (c.array() >= 0).all() && (c.array() < n).all() && full[(c.z() * n + c.y()) * n + c.x()];
  };
  std::size_t through_ties = 0;
  for (int scene = 0; scene < 4; ++scene) {
    for (bool& cube : full) cube = integer(random, 0, 1) == 1;
    refine::TriangleMesh mesh;
    for (int z = 0; z <= n; ++z)
      for (int y = 0; y <= n; ++y)
        for (int x = 0; x <= n; ++x) mesh.positions.emplace_back(x, y, z);
    const auto vertex = [&](const Eigen::Vector3i& v) {
      return static_cast<std::uint32_t>((v.z() * (n + 1) + v.y()) * (n + 1) + v.x());
    };
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < (n + 1) * (n + 1) * (n + 1); ++i) {
        const Eigen::Vector3i at = mesh.positions[static_cast<std::size_t>(i)].cast<int>();
        const Eigen::Vector3i ahead = Eigen::Vector3i::Unit(axis),
                              right = Eigen::Vector3i::Unit((axis + 1) % 3),
                              up = Eigen::Vector3i::Unit((axis + 2) % 3);
        if (is_full(at) == is_full(at - ahead)) continue;
        std::array corners{vertex(at), vertex(at + right), vertex(at + right + up),
                           vertex(at + up)};
        std::rotate(corners.begin(), corners.begin() + integer(random, 0, 1), corners.end());
        mesh.faces.push_back({corners[0], corners[1], corners[2]});
        mesh.faces.push_back({corners[0], corners[2], corners[3]});
      }
    std::vector<std::unique_ptr<Intersector>> faces;
    for (const refine::Face& face : mesh.faces)
      faces.push_back(make_intersector("pluecker", {mesh.positions, {&face, 1}}));
    for (int i = 0; i < 2500; ++i) {
      // From a cube's middle, or from outside along the grid, to a point of a grid of step 1/2.
      const bool outside = i % 2;
      const Vector3d half_steps = integers(random, n) + Vector3d::Constant(n);
      const Eigen::Vector3i cube =
          Eigen::Vector3i::NullaryExpr([&] { return integer(random, 0, 3); });
      Ray ray{outside ? Vector3d(-1, integer(random, 0, n), integer(random, 0, n))
                      : Vector3d(cube.cast<double>() + Vector3d::Constant(0.5))};
      ray.direction = i % 3 == 0 ? Vector3d(Vector3d::Unit(integer(random, 0, 2)))
                                 : Vector3d(0.5 * half_steps - ray.origin);
      if (i % 5 == 0) ray.direction.normalize();
      if (ray.direction.isZero(0.0)) continue;
      std::size_t crossings = 0;
      for (const auto& face : faces) crossings += static_cast<bool>(hit_of(*face, ray));
      REQUIRE(crossings % 2 == (!outside && is_full(cube)));
      through_ties += crossings > 1;
    }
  }
  CHECK(through_ties > 1000);
}

TEST_CASE("the tree changes no bit of an answer") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> real(-1.0, 1.0);
  std::size_t hits = 0;
  for (int scene = 0; scene < 20; ++scene) {
    // Random faces: integers, reals, all sizes, and the whole range of float.
    refine::TriangleMesh mesh = integer_soup(random, 60, 300, 5);
    if (scene % 4 == 1)
      for (Vector3f& p : mesh.positions) p = Vector3f::NullaryExpr([&] { return real(random); });
    if (scene % 4 == 2)
      for (Vector3f& p : mesh.positions) p *= std::ldexp(1.0f, integer(random, -20, 10));
    if (scene % 4 == 3)
      for (Vector3f& p : mesh.positions)
        p = p.unaryExpr([&](float x) { return std::ldexp(x, integer(random, -151, 57)); });
    const auto tree = make_intersector("pluecker", mesh),
               all = make_intersector("brute_force", mesh);
    std::vector<Ray> rays;
    while (rays.size() < 1000) {
      Ray ray{integers(random, 6), integers(random, 2)};
      const std::size_t vertex = static_cast<std::size_t>(integer(random, 0, 59));
      const Vector3d target = mesh.positions[vertex].cast<double>();
      switch (integer(random, 0, 5)) {
        case 0: ray.direction = target - ray.origin; break;
        case 1: ray.origin = target - ray.direction; break;
        case 2: ray.direction *= std::ldexp(1.0, integer(random, -1073, 50)); break;
        case 3: ray.origin *= std::ldexp(1.0, integer(random, -1073, 50)); break;
        case 4: ray.direction[0] *= std::ldexp(-1.0, integer(random, -1073, 50)); break;
        default: ray.t_min = integer(random, 0, 2), ray.t_max = ray.t_min + integer(random, 0, 3);
      }
      const auto largest = [](const Vector3d& v) { return v.lpNorm<Eigen::Infinity>(); };
      if (largest(ray.direction) > 0.0 && largest(ray.direction) <= 1e18 &&
          largest(ray.origin) <= 1e18)
        rays.push_back(ray);
    }
    std::vector<Hit> found(rays.size()), expected(rays.size());
    tree->intersect(rays, found);
    all->intersect(rays, expected);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      REQUIRE(same_hit(found[i], expected[i]));
      if (!found[i]) continue;
      ++hits;
      REQUIRE((found[i].t >= rays[i].t_min && found[i].t <= rays[i].t_max));
      REQUIRE((found[i].u >= 0.0 && found[i].v >= 0.0 && found[i].u + found[i].v <= 1.0 + 1e-15));
    }
  }
  CHECK(hits > 3000);
}

TEST_CASE("a direction may be as short as a double can be, and as long as 1e18") {
  const refine::TriangleMesh mesh{.positions = {{-1, -1, 4}, {3, -1, 4}, {-1, 3, 4}},
                                  .faces = {{0, 1, 2}}};
  const auto tracer = make_intersector("pluecker", mesh);
  for (const int exponent : {-1000, -200, -101, -100, -99, 0, 59}) {
    const double length = std::ldexp(1.0, exponent);
    const Hit hit = hit_of(*tracer, {{0, 0, 0}, {0.0, 0.0, length}});
    REQUIRE(hit);
    CHECK(hit.t == 4.0 / length);
    CHECK(hit.u == 0.25);
    CHECK(hit.v == 0.25);
    CHECK(hit_of(*tracer, {{0, 0, 0}, {0.0, 0.0, length}, 0.0, 4.0 / length}));
    CHECK(!hit_of(*tracer, {{0, 0, 0}, {0.0, 0.0, length}, 0.0, 3.99 / length}));
  }
  // For the smallest denormal, t would overflow at four units.
  CHECK(!hit_of(*tracer, {{0, 0, 0}, {0.0, 0.0, std::numeric_limits<double>::denorm_min()}}));
}
