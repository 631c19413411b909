// What every intersector promises, whatever is inside it.

#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "support/catch.h"

#include <ensonify/engine/random.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/sonar/aperture.h>
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

Hit shoot(const Intersector& tracer, const Ray& ray) {
  Hit hit;
  tracer.intersect({&ray, 1}, {&hit, 1});
  return hit;
}

template <class F>
void for_every_intersector(const refine::TriangleMesh& mesh, F&& check) {
  for (const IntersectorKind& kind : intersector_kinds()) {
    CAPTURE(std::string(kind.name));
    check(*make_intersector(kind.name, mesh));
  }
}

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();

}  // namespace

TEST_CASE("a face is hit from both sides, at the right distance and place") {
  const refine::TriangleMesh mesh = one_face();
  for_every_intersector(mesh, [](const Intersector& tracer) {
    //      | z
    //   o--+--> t = 2          from above and from below
    for (const double side : {1.0, -1.0}) {
      const Hit hit = shoot(tracer, {{0.25, 0.5, 2.0 * side}, {0, 0, -side}});
      REQUIRE(hit);
      CHECK(hit.face == 0);
      CHECK(hit.t == Approx(2.0));
      CHECK(hit.u == Approx(0.25));
      CHECK(hit.v == Approx(0.5));
    }
    CHECK(!shoot(tracer, {{0.6, 0.6, 2.0}, {0, 0, -1}}));  // beside it
    CHECK(!shoot(tracer, {{0.2, 0.2, 2.0}, {0, 0, 1}}));   // behind the origin
  });
}

TEST_CASE("distance counts in lengths of the direction, and ends where the ray does") {
  const refine::TriangleMesh mesh = one_face();
  for_every_intersector(mesh, [](const Intersector& tracer) {
    CHECK(shoot(tracer, {{0.2, 0.2, 2.0}, {0, 0, -4}}).t == Approx(0.5));
    CHECK(!shoot(tracer, {{0.2, 0.2, 2.0}, {0, 0, -1}, 0.0, 1.9}));
    CHECK(!shoot(tracer, {{0.2, 0.2, 2.0}, {0, 0, -1}, 2.1, 9.0}));
    CHECK(shoot(tracer, {{0.2, 0.2, 2.0}, {0, 0, -1}, 1.9, 2.1}));
  });
}

TEST_CASE("of several faces the nearest is hit") {
  refine::TriangleMesh mesh = one_face();
  for (float z : {-1.0f, 1.0f}) {
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    for (int i = 0; i < 3; ++i)
      mesh.positions.push_back(mesh.positions[i] + Eigen::Vector3f(0, 0, z));
    mesh.faces.push_back({n, n + 1, n + 2});
  }
  for_every_intersector(mesh, [](const Intersector& tracer) {
    CHECK(shoot(tracer, {{0.2, 0.2, 5.0}, {0, 0, -1}}).face == 2);
    CHECK(shoot(tracer, {{0.2, 0.2, -5.0}, {0, 0, 1}}).face == 1);
  });
}

TEST_CASE("an empty mesh is missed, and so is a face without area") {
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
    for (const double bad : {not_a_number, inf, -inf, 1e25, 1e38}) {
      CHECK_THROWS_AS(shoot(tracer, {{bad, 0, 0}, {0, 0, 1}}), std::invalid_argument);
      CHECK_THROWS_AS(shoot(tracer, {{0, 0, 0}, {0, bad, 1}}), std::invalid_argument);
      CHECK_THROWS_AS(shoot(tracer, {{0, 0, 0}, {0, 0, 1}, bad, inf}), std::invalid_argument);
    }
    CHECK_THROWS_AS(shoot(tracer, {{0, 0, 0}, {0, 0, 1}, -1.0, inf}), std::invalid_argument);
    CHECK_THROWS_AS(shoot(tracer, {{0, 0, 0}, {0, 0, 1}, 0.0, not_a_number}),
                    std::invalid_argument);
    CHECK_THROWS_AS(shoot(tracer, {{0, 0, 0}, {0, 0, 0}}), std::invalid_argument);
    CHECK(!shoot(tracer, {{0.2, 0.2, 1}, {0, 0, 1e-40}}));  // denormal, and harmless
  });
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity(), 1e38f}) {
    refine::TriangleMesh broken = one_face();
    broken.positions[1].y() = bad;
    for (const IntersectorKind& kind : intersector_kinds())
      CHECK_THROWS_AS(make_intersector(kind.name, broken), refine::MeshError);
  }
}

TEST_CASE("an unknown intersector is refused with the names there are") {
  const refine::TriangleMesh mesh = one_face();
  CHECK_THROWS_WITH(make_intersector("embre", mesh), Catch::Contains("embree, brute_force"));
}

namespace {

struct Agreement {
  std::size_t rays = 0, hits = 0, other_face = 0, leaks = 0, unexplained = 0;
  double largest_relative = 0.0;
};

/// Is the ray within a millionth of its range of one of the face's edges?
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

/// The faces that no ray of a fan can miss by its angle from broadside alone: those not wholly beyond
/// the truncation angle's slab. Brute force over them is brute force over all.
std::vector<std::uint32_t> faces_in_slab(const refine::Triangles& mesh, const RayFan& fan) {
  const double half_width_m = fan.range_m * fan.grid->sin_truncation + 1e-3;
  std::vector<std::uint32_t> inside;
  for (std::uint32_t face = 0; face < mesh.faces.size(); ++face) {
    int before = 0, behind = 0;
    for (int k = 0; k < 3; ++k) {
      const double along_m = (mesh.corner(face, k) - fan.origin).dot(fan.array_axis);
      before += along_m > half_width_m;
      behind += along_m < -half_width_m;
    }
    if (before < 3 && behind < 3) inside.push_back(face);
  }
  return inside;
}

void brute_force(const refine::Triangles& mesh, const RayFan& fan, std::span<Hit> hits) {
  const std::vector<std::uint32_t> inside = faces_in_slab(mesh, fan);
  std::vector<refine::Face> faces;
  for (const std::uint32_t face : inside) faces.push_back(mesh.faces[face]);
  make_intersector("brute_force", {mesh.positions, faces})->intersect(fan, hits);
  for (Hit& hit : hits)
    if (hit) hit.face = inside[hit.face];
}

/// Fans of pings of a scene, embree against brute_force; the pings turn and roll, and move on.
Agreement compare_over(const Scene& scene, int pings) {
  const Seafloor bed = make_seafloor(scene.seafloor, scene.seed);
  const Sonar& sonar = scene.sonars.front();
  const double altitude_m = scene.track.altitude_m;
  const Aperture aperture =
      make_aperture(sonar, 1500.0 / sonar.frequency_hz, sonar.range_m / altitude_m);
  const auto embree = make_intersector("embree", bed.mesh);
  std::vector<Agreement> counts(2 * static_cast<std::size_t>(pings));
  refine::parallel_for(counts.size(), 2, [&](std::size_t item, int) {
    const double step = static_cast<double>(item / 2);
    const Pose pose{.position = {0.3 * step, 0.17 * step, altitude_m - scene.seafloor.depth_m},
                    .roll_rad = 0.02 * step,
                    .heading_rad = 0.4 * step};
    const RayFan fan =
        place_fan(aperture, pose, item % 2 ? Side::starboard : Side::port, sonar.range_m);
    std::vector<Hit> found(fan.grid->rays()), expected(fan.grid->rays());
    embree->intersect(fan, found);
    brute_force(bed.mesh, fan, expected);
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

Scene ripples_scene() {
  return read_scene(std::filesystem::path(ENSONIFY_SOURCE_DIR) / "scenes/ripples.toml");
}

}  // namespace

TEST_CASE(
    "embree hits what brute force hits: 1e5 rays of the ripples scene, leaks along edges apart",
    "[slow]") {
  const Agreement count = compare_over(ripples_scene(), 3);
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

TEST_CASE("embree hits what brute force hits on 3e6 rays of the ripples scene", "[.][soak]") {
  const Agreement count = compare_over(ripples_scene(), 90);
  WARN(count.rays << " rays, " << count.hits << " hits, " << count.other_face
                  << " on a neighbour at the same distance, " << count.leaks
                  << " leaks along an edge, largest relative difference "
                  << count.largest_relative);
  CHECK(count.unexplained == 0);
}
