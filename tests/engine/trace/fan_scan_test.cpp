// Tests of fan_scan in addition to the contract (tests/contract) and the comparison of all
// back-ends.

#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include <Eigen/Geometry>

#include "support/catch.h"
#include "support/fans.h"
#include "support/hits.h"
#include "support/targets.h"

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/trace/check/agreement.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;
using Eigen::Vector3f;
using ensonify::tests::hits_of;

namespace {

/// A square of 2 n^2 faces around (0, 0), side_m wide, at -depth_m with heights of rms_m.
refine::TriangleMesh rough_square(std::uint32_t n, double side_m, double depth_m, double rms_m,
                                  std::uint64_t seed = 5) {
  std::vector<double> heights((n + 1) * (n + 1));
  RandomStream(seed, Purpose::test).normal(heights);
  refine::TriangleMesh mesh;
  for (std::uint32_t j = 0; j <= n; ++j)
    for (std::uint32_t i = 0; i <= n; ++i)
      mesh.positions.emplace_back(static_cast<float>(side_m * (double(i) / n - 0.5)),
                                  static_cast<float>(side_m * (double(j) / n - 0.5)),
                                  static_cast<float>(rms_m * heights[j * (n + 1) + i] - depth_m));
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t k = j * (n + 1) + i;
      mesh.faces.push_back({k, k + 1, k + n + 2});
      mesh.faces.push_back({k + n + 2, k + n + 1, k});
    }
  return mesh;
}

void add(refine::TriangleMesh& mesh, const refine::TriangleMesh& more, const Vector3d& at) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vector3f& p : more.positions)
    mesh.positions.emplace_back((p.cast<double>() + at).cast<float>());
  for (const refine::Face& face : more.faces)
    mesh.faces.push_back({first + face[0], first + face[1], first + face[2]});
}

/// A lumpy stone of 8 n^2 faces.
refine::TriangleMesh stone(int n, double radius_m, std::uint64_t seed) {
  refine::TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> numbers;
  std::array<double, 3> lump;
  RandomStream(seed, Purpose::test).normal(lump);
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [found, is_new] =
        numbers.emplace(at, static_cast<std::uint32_t>(mesh.positions.size()));
    if (is_new) {
      const Vector3d out = Vector3d(at[0], at[1], at[2]).normalized();
      const double swell =
          1.0 + 0.1 * std::sin(5.0 * out.x() + lump[0]) * std::cos(4.0 * out.y() + lump[1]);
      mesh.positions.emplace_back((radius_m * swell * out).cast<float>());
    }
    return found->second;
  };
  for (int octant = 0; octant < 8; ++octant)
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n - i; ++j) {
        const auto at = [&](int x, int y) {
          return vertex(
              {octant & 1 ? -x : x, octant & 2 ? -y : y, octant & 4 ? x + y - n : n - x - y});
        };
        const auto face = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
          if (std::popcount(static_cast<unsigned>(octant)) % 2) std::swap(b, c);
          mesh.faces.push_back({a, b, c});
        };
        face(at(i, j), at(i + 1, j), at(i, j + 1));
        if (j < n - i - 1) face(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
  return mesh;
}

/// Stones, partly half buried, partly floating, on a bed 20 m deep.
refine::TriangleMesh clutter(int stones, std::uint32_t bed_cells = 60) {
  refine::TriangleMesh mesh = rough_square(bed_cells, 60.0, 20.0, 0.05);
  std::vector<double> at(3 * static_cast<std::size_t>(stones));
  RandomStream(9, Purpose::test).uniform(at);
  for (int i = 0; i < stones; ++i) {
    const double* p = &at[3 * static_cast<std::size_t>(i)];
    add(mesh, stone(4, 0.2 + p[2], static_cast<std::uint64_t>(i)),
        {60.0 * (p[0] - 0.5), 60.0 * (p[1] - 0.5), -20.0 + (i % 2 ? 3.0 * p[2] : 0.0)});
  }
  return mesh;
}

struct EastLook {
  Vector3d origin = {0.0, 0.0, -15.0};
  double roll_rad = 0.0, pitch_rad = 0.0, yaw_rad = 0.0;
  double low_rad = 5.0 * degree, high_rad = 90.0 * degree;  // depressions
  double range_m = 50.0;
  int elevations = 400;
};

/// A fan that looks east (before it is turned).
RayFan fan_to_east(const EastLook& look, std::shared_ptr<const FanGrid> grid = nullptr) {
  if (!grid)
    grid = std::make_shared<const FanGrid>(FanLayout{.sector_low_rad = look.low_rad,
                                                     .sector_high_rad = look.high_rad,
                                                     .truncation_rad = 0.05,
                                                     .main_lobe_rad = 0.04,
                                                     .elevations = look.elevations});
  return tests::fan_to_side({.origin = look.origin,
                             .roll_rad = look.roll_rad,
                             .pitch_rad = look.pitch_rad,
                             .yaw_rad = look.yaw_rad,
                             .range_m = look.range_m},
                            std::move(grid));
}

/// Compares fan_scan with the reference on these fans and on fans aimed at the mesh, with static
/// faces and with the faces that the fans can touch.
std::vector<AgreementRow> compare_on(const refine::TriangleMesh& mesh,
                                     const std::vector<RayFan>& fans,
                                     std::uint64_t aimed_fan_rays = 30000) {
  const auto reference = make_intersector("pluecker", mesh);
  FaceSourceParts parts{.all = mesh,
                        .whole = make_intersector("fan_scan", mesh),
                        .progressive = make_progressive_mesh(mesh),
                        .intersector = "fan_scan",
                        .options = {}};
  std::vector<Candidate> candidates;
  for (const char* name : {"static", "footprint"})
    candidates.push_back({.surface = name,
                          .intersector = "fan_scan",
                          .make =
                              [make = face_source_kind(name).make, &parts, &mesh] {
                                return std::make_unique<FacesWithBodies>(
                                    make(parts), static_cast<std::uint32_t>(mesh.faces.size()),
                                    parts);
                              },
                          .precision = Precision::in_double,
                          .has_every_face = std::string_view(name) == "static"});
  std::vector<PingBlock> blocks;
  for (const RayFan& fan : fans) blocks.push_back({{fan}});
  return compare(mesh, *reference, candidates, blocks,
                 {.seed = 3, .aimed_fan_rays = aimed_fan_rays, .threads = 2});
}

void require_sound(const refine::TriangleMesh& mesh, const std::vector<RayFan>& fans,
                   std::uint64_t aimed_fan_rays = 30000) {
  for (const AgreementRow& row : compare_on(mesh, fans, aimed_fan_rays)) {
    CAPTURE(row.surface, static_cast<int>(row.source), row.rays, row.count(Verdict::tie),
            row.count(Verdict::edge), row.count(Verdict::end), row.count(Verdict::coplanar));
    for (const Difference& one : row.unexplained)
      UNSCOPED_INFO("o " << one.ray.origin.transpose() << " d " << one.ray.direction.transpose()
                         << " expected " << one.expected.face << " " << one.expected.t << " found "
                         << one.found.face << " " << one.found.t);
    CHECK(row.count(Verdict::unexplained) == 0);
    CHECK(row.count(Verdict::leak) == 0);
    CHECK(row.largest_dt_of_tolerance <= 1.0);
  }
}

}  // namespace

TEST_CASE("fan_scan agrees with the reference, for any attitude and sector of the sonar") {
  std::vector<RayFan> fans;
  for (const double turn : {-0.4, 0.0, 0.3})
    fans.push_back(fan_to_east({.roll_rad = turn, .pitch_rad = 0.7 * turn, .yaw_rad = 5.0 * turn}));
  fans.push_back(fan_to_east({.low_rad = -30.0 * degree, .high_rad = 120.0 * degree}));
  fans.push_back(fan_to_east({.low_rad = 60.0 * degree, .high_rad = 130.0 * degree}));
  fans.push_back(fan_to_east({.low_rad = -89.0 * degree, .high_rad = 89.0 * degree}));
  require_sound(rough_square(60, 60.0, 20.0, 0.2), fans);
}

TEST_CASE("fan_scan agrees with the reference among stones with overhangs") {
  std::vector<RayFan> fans;
  for (int i = 0; i < 6; ++i)
    fans.push_back(fan_to_east({.origin = {2.0 * i - 5.0, -3.0 * i, -18.5 + 0.7 * i},
                                .roll_rad = 0.05 * i,
                                .yaw_rad = 1.1 * i,
                                .low_rad = -20.0 * degree,
                                .high_rad = 110.0 * degree}));
  require_sound(clutter(80), fans);
}

TEST_CASE("fan_scan agrees with the reference on needles and on faces a kilometre long") {
  refine::TriangleMesh mesh = rough_square(1, 2000.0, 20.0, 0.0);
  add(mesh, rough_square(30, 30.0, 0.0, 0.2), {10.0, 0.0, -18.0});
  for (int i = 0; i < 40; ++i) {  // a million times longer than wide, across and along the track
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    const float at = 0.5f * static_cast<float>(i) + 0.3f;
    if (i % 2) {
      mesh.positions.insert(mesh.positions.end(),
                            {{at, -5.0f, -19.0f}, {at, 5.0f, -19.0f}, {at + 1e-5f, 0.0f, -18.0f}});
    } else {
      mesh.positions.insert(
          mesh.positions.end(),
          {{0.0f, 0.1f, -19.5f}, {50.0f, at, -19.0f}, {25.0f, 0.5f * at, -19.2f}});
    }
    mesh.faces.push_back({n, n + 1, n + 2});
  }
  require_sound(mesh, {fan_to_east({}), fan_to_east({.yaw_rad = 0.4, .range_m = 900.0}),
                       fan_to_east({.origin = {3.0, 1.0, -18.99}, .low_rad = -80 * degree})});
}

TEST_CASE("fan_scan agrees where corners are in the fan's planes, on its rays and at its height") {
  // Level faces at the sonar's height, vertical ones in its planes, the sonar over a vertex.
  refine::TriangleMesh mesh = rough_square(40, 40.0, 20.0, 0.0);
  add(mesh, rough_square(8, 8.0, 0.0, 0.0), {8.0, 0.0, -15.0});
  for (const float y : {0.0f, 1.0f}) {
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(),
                          {{4, y, -20}, {9, y, -20}, {9, y, -14}, {4, y, -14}});
    mesh.faces.push_back({n, n + 1, n + 2});
    mesh.faces.push_back({n, n + 2, n + 3});
  }
  FanGrid grid(FanLayout{.sector_low_rad = -60.0 * degree,
                         .sector_high_rad = 60.0 * degree,
                         .truncation_rad = 0.5,
                         .main_lobe_rad = 0.4,
                         .elevations = 301});
  // Through vertices of the bed 5 m below and of the faces abeam: the tangents are integers.
  grid.planes.clear();
  for (const auto& [across, along] : {std::pair{0, 1}, {1, 8}, {-1, 5}, {1, 4}, {2, 9}, {-3, 10}})
    grid.planes.push_back(
        {across / std::hypot(across, along), along / std::hypot(across, along), 1e-2});
  std::set<double> tangents;
  for (int x = 1; x < 20; ++x)
    for (const double z : {-5.0, -2.0, 0.0, 1.0}) tangents.insert(z / x);
  grid.elevation_rad.clear(), grid.sin_elevation.clear(), grid.cos_elevation.clear();
  for (const double tangent : tangents) {
    grid.elevation_rad.push_back(std::atan(tangent));
    grid.sin_elevation.push_back(tangent / std::hypot(1.0, tangent));
    grid.cos_elevation.push_back(1.0 / std::hypot(1.0, tangent));
  }
  grid.sin_truncation = 1.0;
  const auto tricky = std::make_shared<const FanGrid>(std::move(grid));
  std::vector<RayFan> fans;
  for (const double y : {0.0, 1.0, 0.5})
    for (const double yaw : {0.0, 0.5 * std::numbers::pi})
      fans.push_back(fan_to_east({.origin = {0.0, y, -15.0}, .yaw_rad = yaw}, tricky));
  require_sound(mesh, fans);
}

TEST_CASE("fan_scan takes any tables: two elevations, clusters, one") {
  const refine::TriangleMesh mesh = rough_square(40, 40.0, 20.0, 0.1);
  FanGrid base(FanLayout{.sector_low_rad = 0.1,
                         .sector_high_rad = 1.5,
                         .truncation_rad = 0.05,
                         .main_lobe_rad = 0.04});
  const auto with = [&](const std::vector<double>& elevations) {
    FanGrid grid = base;
    grid.elevation_rad = elevations;
    grid.sin_elevation.clear(), grid.cos_elevation.clear();
    for (const double e : elevations) {
      grid.sin_elevation.push_back(std::sin(e));
      grid.cos_elevation.push_back(std::cos(e));
    }
    return std::make_shared<const FanGrid>(std::move(grid));
  };
  std::vector<double> clusters;
  for (const double centre : {-0.5, 0.0, 0.1, 0.6})
    for (int i = 0; i < 300; ++i) clusters.push_back(centre + 1e-9 * i);
  std::vector<RayFan> fans;
  for (const auto& elevations : {std::vector{-0.3, 0.5}, std::vector{0.0}, clusters})
    for (const double x : {0.0, 1.3})
      fans.push_back(fan_to_east({.origin = {x, 0.1, -15.0}}, with(elevations)));
  require_sound(mesh, fans, 1500);

  const auto scan = make_intersector("fan_scan", mesh);
  CHECK_THROWS_AS(hits_of(*scan, fan_to_east({}, with({0.3, 0.2}))), std::invalid_argument);
  CHECK_THROWS_AS(hits_of(*scan, fan_to_east({}, with({0.3, 1.7}))), std::invalid_argument);
  CHECK(hits_of(*scan, fan_to_east({}, with({}))).empty());
}

TEST_CASE("fan_scan finds no gap between faces with separate corners, in any direction") {
  refine::TriangleMesh parted;
  for (const refine::TriangleMesh whole = stone(40, 10.0, 3);
       const refine::Face& face : whole.faces) {
    refine::Face own;
    for (std::size_t k = 0; k < 3; ++k) {
      // Every second face rotated, and with reversed orientation.
      const std::uint32_t corner = face[parted.faces.size() % 2 ? 2 - k : (k + 1) % 3];
      own[k] = static_cast<std::uint32_t>(parted.positions.size());
      parted.positions.push_back(whole.positions[corner]);
    }
    parted.faces.push_back(own);
  }
  const auto scan = make_intersector("fan_scan", parted);
  const auto reference = make_intersector("pluecker", parted);
  for (int i = 0; i < 40; ++i) {
    const RayFan fan = fan_to_east({.origin = {0.1 * i, 0.03 * i, -0.07 * i},
                                    .roll_rad = 0.3 * i,
                                    .pitch_rad = 0.1 * i,
                                    .yaw_rad = 0.7 * i,
                                    .low_rad = -80.0 * degree,
                                    .high_rad = 95.0 * degree,
                                    .range_m = 100.0,
                                    .elevations = 1000});
    const std::vector<Hit> found = hits_of(*scan, fan), expected = hits_of(*reference, fan);
    for (std::size_t ray = 0; ray < found.size(); ++ray) {
      if (!fan.grid->within_beam(ray / fan.elevations(), ray % fan.elevations())) continue;
      REQUIRE(found[ray]);
      REQUIRE(found[ray].t == Approx(expected[ray].t).epsilon(1e-9));
    }
  }
}

TEST_CASE("of faces at one place fan_scan hits the first, in any orientation of the others") {
  const refine::TriangleMesh whole = rough_square(40, 40.0, 20.0, 0.2);
  refine::TriangleMesh doubled = whole;
  for (const refine::Face& face : whole.faces) {
    doubled.faces.push_back({face[1], face[2], face[0]});
    doubled.faces.push_back({face[2], face[1], face[0]});
  }
  refine::TriangleMesh reversed = doubled;
  std::ranges::reverse(reversed.faces);
  const RayFan fan = fan_to_east({.roll_rad = 0.1, .pitch_rad = 0.05, .yaw_rad = 0.8});
  const auto once = hits_of(*make_intersector("fan_scan", whole), fan);
  const auto twice = hits_of(*make_intersector("fan_scan", doubled), fan);
  const auto backwards = hits_of(*make_intersector("fan_scan", reversed), fan);
  std::size_t met = 0;
  for (std::size_t ray = 0; ray < once.size(); ++ray) {
    REQUIRE(once[ray].face == twice[ray].face);
    if (!once[ray]) continue;
    ++met;
    // Each face has three copies, the last of the duplicates first.
    const std::size_t faces = whole.faces.size(), last = 3 * faces - 1;
    REQUIRE(backwards[ray].face == last - (faces + 2 * std::size_t{once[ray].face} + 1));
    REQUIRE(backwards[ray].t == Approx(once[ray].t).epsilon(1e-12));
  }
  CHECK(met > 1000);
}

TEST_CASE("fan_scan's runs are those of its hits, to the last bit") {
  refine::TriangleMesh mesh = clutter(60);
  std::vector<RayFan> fans;
  bool through_sonar = false;
  SECTION("of any look and range") {
    for (const double turn : {0.0, 0.2, 2.5})
      for (const bool mirrored : {false, true})
        for (const double range_m : {50.0, 21.0}) {
          fans.push_back(
              fan_to_east({.roll_rad = 0.3 * turn, .yaw_rad = turn, .range_m = range_m}));
          if (mirrored) fans.back().array_axis = -fans.back().array_axis;
        }
  }
  SECTION("where a face goes through the sonar, which all rays hit there") {
    mesh.positions = {{-1.0f, -1.0f, -14.0f}, {1.0f, -1.0f, -14.0f}, {0.0f, 2.0f, -17.0f}};
    mesh.faces = {{0, 1, 2}};
    fans.push_back(fan_to_east({}));
    through_sonar = true;
  }
  const auto scan = make_intersector("fan_scan", mesh);
  for (const RayFan& fan : fans) {
    const std::vector<Hit> hits = hits_of(*scan, fan);
    FanRuns expected, runs;
    expected.take(fan, mesh, hits);
    REQUIRE(scan->list_runs(fan, runs));
    REQUIRE(runs.first == expected.first);
    REQUIRE(runs.size() >= (through_sonar ? fan.planes() : 101));
    const auto same = [&](const auto& a, const auto& b) {
      return std::memcmp(a.data(), b.data(), runs.size() * sizeof a[0]) == 0;
    };
    CHECK(same(runs.begin, expected.begin));
    CHECK(same(runs.end, expected.end));
    CHECK(same(runs.index, expected.index));
    CHECK(same(runs.face, expected.face));
    CHECK(same(runs.level, expected.level));
    CHECK(same(runs.pole, expected.pole));
    if (through_sonar)  // 0 or -0
      CHECK(std::equal(runs.distance.begin(), runs.distance.begin() + std::ptrdiff_t(runs.size()),
                       expected.distance.begin()));
    else
      CHECK(same(runs.distance, expected.distance));
  }
}

TEST_CASE("a run's plane contains its rays' hits, and gives the side of the face that they see") {
  const refine::TriangleMesh mesh = clutter(60);
  const RayFan fan = fan_to_east({.roll_rad = 0.1, .yaw_rad = 1.0});
  const std::vector<Hit> hits = hits_of(*make_intersector("pluecker", mesh), fan);
  FanRuns runs;
  runs.take(fan, mesh, hits);
  std::size_t rays = 0, met = 0;
  for (const Hit& hit : hits) met += static_cast<bool>(hit);
  for (std::size_t plane = 0; plane < fan.planes(); ++plane)
    for (std::size_t i = runs.first[plane]; i < runs.first[plane + 1]; ++i)
      for (std::size_t j = runs.begin[i]; j < runs.end[i]; ++j, ++rays) {
        const Hit& hit = hits[plane * fan.elevations() + j];
        REQUIRE(hit.index == runs.index[i]);
        REQUIRE(hit.face == runs.face[i]);
        const refine::Triangles all = mesh;
        const Vector3d a = all.corner(hit.index, 0);
        const double towards = (all.corner(hit.index, 1) - a)
                                   .cross(all.corner(hit.index, 2) - a)
                                   .normalized()
                                   .dot(fan.ray(plane, j).direction);
        const double facing =
            runs.level[i] * fan.grid->cos_elevation[j] + runs.pole[i] * fan.grid->sin_elevation[j];
        REQUIRE(facing == Approx(towards).margin(1e-6));
        REQUIRE(runs.distance[i] / facing == Approx(hit.t).epsilon(1e-9));
      }
  CHECK(rays == met);
}

TEST_CASE("fan_scan gives the same bits on every vector target, and on plain numbers") {
  const refine::TriangleMesh mesh = clutter(60);
  const std::vector<RayFan> fans{
      fan_to_east(
          {.roll_rad = 0.1, .pitch_rad = 0.2, .low_rad = -30 * degree, .high_rad = 100 * degree}),
      fan_to_east({.origin = {1.0, 2.0, -19.0}, .yaw_rad = 2.0, .elevations = 1001})};
  const auto bytes = [&] {
    std::vector<std::uint64_t> all;
    const auto scan = make_intersector("fan_scan", mesh);
    for (const RayFan& fan : fans)
      for (const Hit& hit : hits_of(*scan, fan))
        all.insert(all.end(),
                   {std::uint64_t{hit.index} << 32 | hit.face, std::bit_cast<std::uint64_t>(hit.t),
                    std::bit_cast<std::uint64_t>(hit.u), std::bit_cast<std::uint64_t>(hit.v)});
    return all;
  };
  const std::vector<std::uint64_t> expected = bytes();
  tests::on_each_target([&] { CHECK(bytes() == expected); });
}

TEST_CASE("fan_scan refuses a list of rays and names back-ends that take it") {
  const refine::TriangleMesh mesh = rough_square(2, 2.0, 1.0, 0.0);
  const auto scan = make_intersector("fan_scan", mesh);
  const Ray ray;
  Hit hit;
  CHECK_THROWS_WITH(scan->intersect({&ray, 1}, {&hit, 1}), Catch::Contains("fans only"));
}

TEST_CASE("fan_scan works up to the contract's largest numbers") {
  constexpr float big = 1e18f;
  const refine::TriangleMesh mesh{
      .positions = {{big, big, -big}, {-big, big, -big}, {0, -big, -big}, {1e-30f, 1, -1}},
      .faces = {{0, 1, 2}, {0, 1, 3}, {3, 2, 0}}};
  for (const Vector3d& origin :
       {Vector3d(0, 0, 0), Vector3d(-1e18, 1e18, 1e18), Vector3d(1, 1, -1)})
    for (const double range_m : {0.0, 10.0, 1e18}) {
      const RayFan fan =
          fan_to_east({.origin = origin, .high_rad = 120 * degree, .range_m = range_m});
      for (const Hit& hit : hits_of(*make_intersector("fan_scan", mesh), fan)) {
        if (!hit) continue;
        REQUIRE((hit.t >= 0.0 && hit.t <= range_m));
        REQUIRE((hit.u >= -1e-5 && hit.v >= -1e-5 && hit.u + hit.v <= 1.0 + 1e-5));
      }
    }
}
