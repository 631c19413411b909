// Tests that the comparison finds faults: each fault is planted in a sound intersector, and rays
// from every source must find the fault. Correct behaviour must pass.

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>

#include <Eigen/Geometry>

#include "support/catch.h"
#include "support/hits.h"
#include "support/meshes.h"

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/trace/check/adversarial_rays.h>
#include <ensonify/engine/trace/check/agreement.h>
#include <ensonify/engine/trace/check/fan_comparison.h>
#include <ensonify/engine/trace/check/hierarchy.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/engine/trace/face_sources/static_faces.h>
#include <ensonify/refine/tile_collapse.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;
using ensonify::tests::hit_of;

namespace {

/// A rough bed of 2 x 16 x 16 faces in a square of 8 m, 20 m deep, with a column of needles.
refine::TriangleMesh bed_with_needles() {
  constexpr std::uint32_t side = 17;
  std::vector<double> heights(side * side);
  RandomStream(5, Purpose::test).normal(heights);
  return tests::sheet(side, side, [&](double i, double j) -> Vector3d {
    return Eigen::Vector3f(
               i == 8 ? -0.499f : -4.0f + 0.5f * static_cast<float>(i),
               -4.0f + 0.5f * static_cast<float>(j),
               static_cast<float>(-20.0 + 0.15 * heights[static_cast<std::size_t>(j * side + i)]))
        .cast<double>();
  });
}

/// Two fans that look down at the bed from 3 m above it.
std::vector<RayFan> bed_fans() {
  const auto grid = std::make_shared<const FanGrid>(FanLayout{.sector_low_rad = 0.3,
                                                              .sector_high_rad = 1.7,
                                                              .truncation_rad = 0.2,
                                                              .main_lobe_rad = 0.2,
                                                              .planes = 8,
                                                              .elevations = 256});
  const double c = std::cos(1.0), s = std::sin(1.0);
  return {{grid, {0.1, -2.3, -17.0}, {1, 0, 0}, {0, c, -s}, {0, s, c}, 30.0},
          {grid, {-1.7, 0.2, -17.1}, {0, -1, 0}, {c, 0, -s}, {s, 0, c}, 30.0}};
}

/// The answers of a sound intersector, some of them changed.
class Spoilt final : public Intersector {
 public:
  using Fault = std::function<Hit(const Ray& ray, const Hit& hit, const Intersector& sound)>;

  Spoilt(refine::Triangles triangles, Fault fault, bool fans_only = false)
      : sound_(make_intersector("pluecker", triangles)),
        fault_(std::move(fault)),
        fans_only_(fans_only) {}

  void build(refine::Triangles triangles) override { sound_->build(triangles); }
  std::string_view code_path() const override { return "portable"; }
  void intersect(const RayFan& fan, std::span<Hit> hits) const override {
    sound_->intersect(fan, hits);
    for (std::size_t plane = 0; plane < fan.planes(); ++plane)
      for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation) {
        Hit& hit = hits[plane * fan.elevations() + elevation];
        if (fan.grid->within_beam(plane, elevation))
          hit = fault_(fan.ray(plane, elevation), hit, *sound_);
      }
  }
  void intersect(std::span<const Ray> rays, std::span<Hit> hits) const override {
    if (fans_only_) throw std::invalid_argument("fans only");
    sound_->intersect(rays, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = fault_(rays[i], hits[i], *sound_);
  }

 private:
  std::unique_ptr<Intersector> sound_;
  Fault fault_;
  bool fans_only_;
};

/// Volatile, because GCC 12 removes a vector's conversion from double to float and back.
Vector3d in_float(const Vector3d& v) {
  return v.unaryExpr([](double x) {
    const volatile float rounded = static_cast<float>(x);
    return static_cast<double>(rounded);
  });
}

Hit no_fault(const Ray&, const Hit& hit, const Intersector&) { return hit; }

/// The next hit behind a hit.
Hit next(const Ray& ray, const Hit& hit, const Intersector& sound) {
  Ray rest = ray;
  rest.t_min = hit.t * (1.0 + 1e-9);
  return rest.t_min <= rest.t_max ? hit_of(sound, rest) : Hit{};
}

/// Static faces with an intersector, to which bodies may be added.
std::unique_ptr<FacesWithBodies> static_faces(refine::Triangles mesh,
                                              std::shared_ptr<const Intersector> whole) {
  const FaceSourceParts parts{.all = mesh, .whole = std::move(whole), .intersector = "pluecker"};
  return std::make_unique<FacesWithBodies>(make_static_faces(parts),
                                           static_cast<std::uint32_t>(mesh.faces.size()), parts);
}

std::vector<AgreementRow> compare_one(refine::Triangles mesh,
                                      std::shared_ptr<const Intersector> candidate, int threads = 2,
                                      std::uint64_t every = 1,
                                      decltype(AgreementOptions::progress) progress = {}) {
  const auto reference = make_intersector("pluecker", mesh);
  const Candidate one{.surface = "static",
                      .intersector = "candidate",
                      .make = [&] { return static_faces(mesh, candidate); },
                      .every = every};
  std::vector<PingBlock> blocks;
  for (const RayFan& fan : bed_fans()) blocks.push_back({{fan}});
  return compare(mesh, *reference, {&one, 1}, blocks,
                 {.seed = 7,
                  .aimed_fan_rays = 40000,
                  .aimed_rays = 20000,
                  .threads = threads,
                  .progress = std::move(progress)});
}

std::uint64_t total(const std::vector<AgreementRow>& rows, Verdict verdict) {
  std::uint64_t sum = 0;
  for (const AgreementRow& row : rows) sum += row.count(verdict);
  return sum;
}

//  y
//  2  3---2      a square of two faces in the plane z = 0, and a second at z = -1
//     | \1|
//     |0 \|      (the diagonal from 3 to 1)
//  0  0---1  x
refine::TriangleMesh two_squares() {
  refine::TriangleMesh mesh;
  for (const float z : {0.0f, -1.0f}) {
    const auto n = static_cast<std::uint32_t>(mesh.positions.size());
    for (const auto& [x, y] : {std::pair{0.0f, 0.0f}, {2.0f, 0.0f}, {2.0f, 2.0f}, {0.0f, 2.0f}})
      mesh.positions.emplace_back(x, y, z);
    mesh.faces.push_back({n, n + 1, n + 3});
    mesh.faces.push_back({n + 1, n + 2, n + 3});
  }
  return mesh;
}

/// A ray straight down from z = 1.
Ray down(double x, double y) { return {{x, y, 1.0}, {0, 0, -1}}; }

}  // namespace

TEST_CASE("a different answer is judged by its place") {
  const refine::TriangleMesh mesh = two_squares();
  const auto reference = make_intersector("pluecker", mesh);
  const Judge judge(mesh, *reference);
  const auto verdict = [&](const Ray& ray, const Hit& found) {
    return judge.judge(ray, hit_of(*reference, ray), found);
  };
  const Hit miss;
  const double close = 1e-8, apart = 1e-4;

  // At the lower left of the diagonal, where face 0 is hit.
  const auto face_1_at = [](double x, double y, double t) {
    return Hit{1, 1, t, (2.0 - x) < 0.0 ? 0.0 : 0.5 * (x + y) - 1.0, 1.0 - 0.5 * x};
  };
  CHECK(verdict(down(1.0 - close, 1.0), face_1_at(1.0 - close, 1.0, 1.0)) == Verdict::tie);
  CHECK(verdict(down(1.0 - apart, 1.0), face_1_at(1.0 - apart, 1.0, 1.0)) == Verdict::unexplained);

  // Two faces in one plane: the answer may be either.
  refine::TriangleMesh twice = mesh;
  for (const auto& [x, y] : {std::pair{-1.0f, -1.0f}, {3.0f, -1.0f}, {1.0f, 5.0f}})
    twice.positions.emplace_back(x, y, 0.0f);
  twice.faces.push_back({8, 9, 10});
  const auto reference_of_both = make_intersector("pluecker", twice);
  const Judge judge_of_both(twice, *reference_of_both);
  const Hit upper = hit_of(*reference_of_both, down(0.7, 0.7));
  REQUIRE(upper.face == 0);
  const Hit of_other{4, 4, upper.t, 1.7 / 6.0, 1.7 / 6.0};
  CHECK(judge_of_both.judge(down(0.7, 0.7), upper, of_other) == Verdict::tie);
  CHECK(judge_of_both.is_overlap(down(0.7, 0.7), upper, of_other, Precision::in_float));
  CHECK(!judge.is_overlap(down(1.0 - close, 1.0), hit_of(*reference, down(1.0 - close, 1.0)),
                          face_1_at(1.0 - close, 1.0, 1.0), Precision::in_float));

  // Passing through: a leak at the diagonal, allowed at the border, unexplained elsewhere.
  CHECK(verdict(down(1.0 - close, 1.0), miss) == Verdict::leak);  // through both squares
  CHECK(verdict(down(1.0, 0.0 + close), miss) == Verdict::edge);  // past both at the border
  CHECK(verdict(down(1.0, 0.0 + apart), miss) == Verdict::unexplained);
  Ray short_one = down(1.0 - close, 1.0);
  short_one.t_max = 1.5;
  CHECK(verdict(short_one, miss) == Verdict::leak);
  short_one.origin.x() = 0.7;
  CHECK(verdict(short_one, miss) == Verdict::unexplained);

  // The square below, found through the diagonal of the upper one; and below that, nothing.
  const Ray at_diagonal = down(1.0 - close, 1.0);
  const Hit lower = next(at_diagonal, hit_of(*reference, at_diagonal), *reference);
  REQUIRE(lower.face >= 2);
  CHECK(verdict(at_diagonal, lower) == Verdict::leak);
  CHECK(verdict(down(0.7, 0.7), next(down(0.7, 0.7), hit_of(*reference, down(0.7, 0.7)),
                                     *reference)) == Verdict::unexplained);

  // At the ray's end.
  for (const double end : {1.0, 1.0 - 1e-9, 1.0 + 1e-9}) {
    Ray ray = down(0.5, 0.5);
    ray.t_max = end;
    if (hit_of(*reference, ray)) CHECK(verdict(ray, miss) == Verdict::end);
    if (!hit_of(*reference, ray)) CHECK(verdict(ray, {0, 0, end, 0.25, 0.25}) == Verdict::end);
    CHECK(verdict(ray, {0, 0, 1.0 + 1e-6, 0.25, 0.25}) == Verdict::unexplained);  // beyond it
  }

  // A face whose plane contains the ray may be hit or not, anywhere; a face beside the ray may not.
  const Ray level{{-1.0, 1.0, 0.0}, {1, 0, 0}};
  REQUIRE(!hit_of(*reference, level));
  CHECK(verdict(level, {0, 0, 1.3, 0.2, 0.5}) == Verdict::coplanar);
  CHECK(verdict({{-1.0, 2.5, 0.0}, {1, 0, 0}}, {0, 0, 1.3, 0.2, 0.5}) == Verdict::coplanar);
  CHECK(verdict({{-1.0, 1.0, 1e-3}, {1, 0, 0}}, {0, 0, 1.3, 0.2, 0.5}) == Verdict::unexplained);
  CHECK(verdict(level, {2, 2, 1.3, 0.2, 0.5}) == Verdict::unexplained);

  CHECK(verdict(down(5.0, 5.0), miss) == Verdict::same);
  CHECK(verdict(down(5.0, 5.0), {0, 0, 1.0, 0.3, 0.3}) == Verdict::unexplained);
  CHECK(verdict(down(0.5, 0.5), {4, 4, 1.0, 0.25, 0.25}) == Verdict::unexplained);  // no such face
  CHECK(verdict(down(0.5, 0.5), {0, 0, std::nan(""), 0.25, 0.25}) == Verdict::unexplained);
  CHECK(verdict(down(0.5, 0.5), {0, 0, 1.0, std::nan(""), 0.25}) == Verdict::unexplained);
}

TEST_CASE("beyond a needle's tip both edges may count as hit, beside the needle neither") {
  const refine::TriangleMesh needle{
      .positions = {{0.0f, 0.0f, 0.0f}, {0.9f, 0.0f, 0.0f}, {0.9f, 0.003f, 0.0f}},
      .faces = {{0, 1, 2}}};
  const auto reference = make_intersector("pluecker", needle);
  const Judge judge(needle, *reference);
  const Hit tip{0, 0, 1.0, 0.0, 0.0};
  const auto verdict = [&](const Ray& ray) {
    REQUIRE(!hit_of(*reference, ray));
    return judge.judge(ray, {}, tip);
  };
  CHECK(verdict(down(-1e-4, 0.0)) == Verdict::edge);  // 3e-7 from the farther edge's line
  CHECK(verdict(down(-1e-4, -1e-4)) == Verdict::unexplained);
  CHECK(verdict(down(-1e-2, 0.0)) == Verdict::unexplained);
}

TEST_CASE("every intersector agrees with the reference, the exact ones to the bit") {
  const refine::TriangleMesh mesh = bed_with_needles();
  for (const IntersectorKind& kind : intersector_kinds()) {
    CAPTURE(std::string(kind.name));
    for (const AgreementRow& row : compare_one(mesh, make_intersector(kind.name, mesh))) {
      CAPTURE(ray_source_names[static_cast<std::size_t>(row.source)]);
      CHECK(row.rays >= 3000);
      CHECK(row.count(Verdict::unexplained) == 0);
      CHECK(row.unexplained.empty());
      if (kind.name == "pluecker" || kind.name == "brute_force") {
        CHECK(row.count(Verdict::leak) == 0);
        CHECK(row.count(Verdict::same) == row.rays);
        CHECK(row.largest_dt_m <= 1e-9);
      }
    }
  }
}

TEST_CASE("a planted fault is caught by rays from every source") {
  const refine::TriangleMesh mesh = bed_with_needles();
  refine::TriangleMesh shifted = mesh;
  shifted.positions[8 * 17 + 4].z() += 1e-3f;
  refine::TriangleMesh turned = mesh;  // the diagonal of one square
  turned.faces[300] = {mesh.faces[300][0], mesh.faces[300][1], mesh.faces[301][2]};
  turned.faces[301] = {mesh.faces[300][1], mesh.faces[300][2], mesh.faces[301][2]};

  struct Planted {
    std::string name;
    Spoilt::Fault fault;
    const refine::TriangleMesh& over;
  };
  const std::vector<Planted> planted{
      {"t a ten-thousandth too far", [](auto&, Hit hit, auto&) { return hit.t *= 1.0 + 1e-4, hit; },
       mesh},
      {"t a ten-thousandth too near",
       [](auto&, Hit hit, auto&) { return hit.t *= 1.0 - 1e-4, hit; }, mesh},
      {"the number of the face beside",
       [](auto&, Hit hit, auto&) { return hit ? hit.face ^= 1, hit : hit; }, mesh},
      {"a face dropped",
       [](auto& ray, const Hit& hit, auto& sound) {
         return hit.face % 64 == 7 ? next(ray, hit, sound) : hit;
       },
       mesh},
      {"the face behind",
       [](auto& ray, const Hit& hit, auto& sound) {
         const Hit behind = hit ? next(ray, hit, sound) : hit;
         return behind ? behind : hit;
       },
       mesh},
      {"one miss in a hundred",
       [](auto&, const Hit& hit, auto&) { return std::fmod(hit.t, 0.01) < 1e-4 ? Hit{} : hit; },
       mesh},
      {"a hit where there is none",
       [](auto&, const Hit& hit, auto&) {
         return hit ? hit : Hit{9, 9, 1.0, 0.3, 0.3};
       },
       mesh},
      {"a hit beyond the end",
       [](auto& ray, Hit hit, auto&) {
         return hit && std::isfinite(ray.t_max) ? hit.t = 1.001 * ray.t_max, hit : hit;
       },
       mesh},
      {"u and v swapped", [](auto&, Hit hit, auto&) { return std::swap(hit.u, hit.v), hit; }, mesh},
      {"t in metres, not in lengths of the direction, or doubled",
       [](auto& ray, Hit hit, auto&) {
         const double length = ray.direction.norm();
         return hit.t *= std::abs(length - 1.0) > 1e-9 ? length : 2.0, hit;
       },
       mesh},
      {"a vertex a millimetre too high", no_fault, shifted},
      {"a square cut the other way", no_fault, turned},
  };
  for (const Planted& fault : planted) {
    CAPTURE(fault.name);
    const auto rows = compare_one(mesh, std::make_shared<Spoilt>(fault.over, fault.fault));
    REQUIRE(rows.size() == 3);
    for (const AgreementRow& row : rows) {
      CAPTURE(ray_source_names[static_cast<std::size_t>(row.source)], row.rays);
      CHECK(row.count(Verdict::unexplained) > 0);
      CHECK(row.unexplained.size() == std::min<std::uint64_t>(5, row.count(Verdict::unexplained)));
    }
  }
}

TEST_CASE("a t that is off by a ten-thousandth is caught on nearly every ray of a fan that hits") {
  const refine::TriangleMesh mesh = bed_with_needles();
  const auto rows = compare_one(mesh, std::make_shared<Spoilt>(mesh, [](auto&, Hit hit, auto&) {
                                  return hit.t *= 1.0 + 1e-4, hit;
                                }));
  const auto fans = bed_fans();
  std::uint64_t hits = 0;
  for (const RayFan& fan : fans) {
    std::vector<Hit> found(fan.grid->rays());
    make_intersector("pluecker", mesh)->intersect(fan, found);
    for (const Hit& hit : found) hits += static_cast<bool>(hit);
  }
  CHECK(rows[0].source == RaySource::scene);
  CHECK(hits > 1000);
  CHECK(static_cast<double>(rows[0].count(Verdict::unexplained)) >
        0.98 * static_cast<double>(hits));
}

TEST_CASE("duplicate faces are ties, any of them") {
  refine::TriangleMesh mesh = bed_with_needles();
  const auto faces = static_cast<std::uint32_t>(mesh.faces.size());
  for (std::uint32_t face = 0; face < faces; ++face) mesh.faces.push_back(mesh.faces[face]);
  const auto rows = compare_one(mesh, std::make_shared<Spoilt>(mesh, [&](auto&, Hit hit, auto&) {
                                  return hit ? hit.index = hit.face += faces, hit : hit;
                                }));
  for (const AgreementRow& row : rows) {
    CHECK(row.count(Verdict::unexplained) == 0);
    CHECK(row.count(Verdict::tie) > 1000);
    CHECK(row.count(Verdict::leak) + row.count(Verdict::end) + row.count(Verdict::edge) == 0);
    if (row.source != RaySource::aimed_rays) CHECK(row.count(Verdict::coplanar) == 0);
  }
}

TEST_CASE("rays that slip through along edges are leaks, not unexplained misses") {
  const refine::TriangleMesh mesh = bed_with_needles();
  const auto rows =
      compare_one(mesh, std::make_shared<Spoilt>(mesh, [](auto& ray, const Hit& hit, auto& sound) {
                    const bool at_edge = std::min({hit.u, hit.v, 1.0 - hit.u - hit.v}) < 1e-12;
                    return hit && at_edge ? next(ray, hit, sound) : hit;
                  }));
  CHECK(total(rows, Verdict::unexplained) == 0);
  CHECK(total(rows, Verdict::leak) > 1000);
}

TEST_CASE("a stopped comparison's rows have the counts that its progress reported") {
  const refine::TriangleMesh mesh = bed_with_needles();
  const auto faulty = std::make_shared<Spoilt>(mesh, [](auto& ray, Hit hit, auto& sound) {
    if (hit.face % 64 == 7) return hit.t *= 1.0 + 1e-4, hit;
    const bool at_edge = std::min({hit.u, hit.v, 1.0 - hit.u - hit.v}) < 1e-12;
    return hit && at_edge ? next(ray, hit, sound) : hit;
  });
  const int items = static_cast<int>(bed_fans().size()) + 3;
  for (const int threads : {1, 3}) {
    AgreementProgress told;
    int tellings = 0;
    const auto rows = compare_one(mesh, faulty, threads, 1, [&](const AgreementProgress& now) {
      told = now;
      return ++tellings < items;
    });
    std::uint64_t rays = 0;
    for (const AgreementRow& row : rows) rays += row.rays;
    CHECK(tellings >= items);
    CHECK(tellings < items + threads);
    CHECK(told.rays < told.of / 2);
    CHECK(rays == told.rays);
    CHECK(total(rows, Verdict::unexplained) == told.unexplained);
    CHECK(total(rows, Verdict::leak) == told.leaks);
    CHECK(told.unexplained > 0);
    CHECK(told.leaks > 0);
  }
}

TEST_CASE("an answer computed for the ray rounded to float is within the tolerance") {
  const refine::TriangleMesh mesh = bed_with_needles();
  const auto tracer = make_intersector("pluecker", mesh);
  const Judge judge(mesh, *tracer);
  std::vector<Ray> rays(20000);
  AdversarialRays(mesh, 3).aim(0, rays);
  double largest = 0.0;
  for (const Ray& ray : rays) {
    Ray rounded = ray;
    rounded.origin = in_float(ray.origin);
    rounded.direction = in_float(ray.direction);
    const Hit exact = hit_of(*tracer, ray), moved = hit_of(*tracer, rounded);
    if (!exact || moved.face != exact.face) continue;
    largest = std::max(largest, std::abs(moved.t - exact.t) * ray.direction.norm() /
                                    judge.tolerance_m(ray, exact.face));
  }
  CHECK(largest < 1.0);
  CHECK(largest > 0.02);  // and the tolerance is not much too large

  // From 10 m, at 45 degrees to an even face, a hit must be right to some hundredths of a
  // millimetre.
  const refine::TriangleMesh square = two_squares();
  CHECK(Judge(square, *tracer).tolerance_m({{-6.0, 1.0, 7.0}, {1, 0, -1}}, 0) < 5e-5);
}

TEST_CASE("hits and runs of a fan are within the tolerance where faces are small and far") {
  // Faces of 3 cm at 33 m: there the roundings of the fan's frame count most.
  constexpr std::uint32_t side = 41;
  const Vector3d ahead = Vector3d(1.0, 1.0, -1.0).normalized();
  const Vector3d right = ahead.cross(Vector3d::UnitZ()).normalized(), up = right.cross(ahead);
  std::vector<double> random(side * side);
  RandomStream(9, Purpose::test).normal(random);
  const refine::TriangleMesh mesh = tests::sheet(side, side, [&](double i, double j) -> Vector3d {
    const double rough_m = 0.01 * random[static_cast<std::size_t>(j * side + i)];
    const Vector3d place = (33.0 + rough_m) * ahead + 0.03 * ((i - 20.0) * right + (j - 20.0) * up);
    return place.cast<float>().cast<double>();
  });
  const auto grid = std::make_shared<const FanGrid>(FanLayout{.sector_low_rad = -0.02,
                                                              .sector_high_rad = 0.02,
                                                              .truncation_rad = 0.02,
                                                              .main_lobe_rad = 0.02,
                                                              .planes = 24,
                                                              .elevations = 400});
  const auto reference = make_intersector("pluecker", mesh);
  const auto surface = static_faces(mesh, make_intersector("fan_scan", mesh));
  const Judge judge(mesh, *reference);
  FanComparison comparison(judge, Precision::in_double);
  AgreementCounts counts;
  for (int i = 0; i < 24; ++i) {
    const double turn = 0.26 * i;
    const Vector3d array = std::cos(turn) * right + std::sin(turn) * up;
    const RayFan fan{grid, Vector3d::Zero(), array, ahead, array.cross(ahead), 50.0};
    std::vector<Hit> expected(grid->rays());
    reference->intersect(fan, expected);
    const Faces faces = comparison.prepare(*surface, {&fan, 1});
    comparison.fan(0, faces, fan, {.by_reference = expected, .on_static = {}}, counts);
  }
  CHECK(counts.rays > 100000);
  CHECK(counts.wrong_run == 0);
  CHECK(counts.count(Verdict::unexplained) == 0);
  CHECK(counts.largest_dt_of_tolerance < 0.7);
  CHECK(counts.largest_dt_of_tolerance > 0.1);  // and the tolerance is not much too large
}

TEST_CASE("either face at an edge that is far away is a tie") {
  constexpr double edge_m = 1.25;
  std::vector<double> random(6 * 500);
  RandomStream(10, Purpose::test).uniform(random);
  for (std::size_t i = 0; i < random.size(); i += 6) {
    const double* of = &random[i];
    const Vector3d middle = Vector3d(4000.0 * of[0] + 8000.0, 4000.0 * of[1], -2000.0 * of[2]);
    refine::TriangleMesh square;
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}})
      square.positions.emplace_back(
          (middle + edge_m * Vector3d(x, y, 0.3 * x * of[3] - 0.2 * y * of[4])).cast<float>());
    square.faces = {{0, 1, 2}, {0, 2, 3}};
    const double along = 0.1 + 0.8 * of[5];
    const Vector3d a = square.positions[0].cast<double>(), c = square.positions[2].cast<double>();
    // With an origin of many bits, products of corners are not exact in double.
    const Vector3d origin = Eigen::Vector3f(0.3f, -0.7f, 0.11f).cast<double>();
    const Vector3d place = a + along * (c - a) - origin;
    const Ray ray{origin, place.normalized()};
    const double t = place.norm();
    const Hit one{.face = 0, .index = 0, .t = t, .u = 0.0, .v = along};
    const Hit other{.face = 1, .index = 1, .t = t, .u = along, .v = 0.0};
    const auto reference = make_intersector("pluecker", square);
    const Judge judge(square, *reference);
    const Hit expected = hit_of(*reference, ray);
    CAPTURE(middle.transpose());
    REQUIRE(expected);
    CHECK(judge.judge(ray, expected, expected.face == 0 ? other : one, Precision::in_double) ==
          Verdict::tie);
  }
}

TEST_CASE("counts of two comparisons add up, and each largest difference stays") {
  const Difference first{.ray = {.t_max = 1.0}}, second{.ray = {.t_max = 2.0}};
  AgreementCounts a{
      .largest_dt_m = 5.0, .largest_dt_relative = 1.0, .largest_dt_of_tolerance = 6.0};
  a.coarse = 1;
  a.unlike_static = 2;
  a.wrong_index = 3;
  a.wrong_run = 4;
  a.add(Verdict::same, first);
  a.add(Verdict::unexplained, first);
  AgreementCounts b{
      .largest_dt_m = 2.0, .largest_dt_relative = 4.0, .largest_dt_of_tolerance = 3.0};
  b.coarse = 10;
  b.unlike_static = 20;
  b.wrong_index = 30;
  b.wrong_run = 40;
  b.add(Verdict::unexplained, second);
  AgreementCounts a_and_b = a, b_and_a = b;
  a_and_b += b;
  b_and_a += a;
  for (const AgreementCounts& sum : {a_and_b, b_and_a}) {
    CHECK(sum.rays == 3);
    CHECK(sum.count(Verdict::same) == 1);
    CHECK(sum.count(Verdict::unexplained) == 2);
    CHECK(sum.largest_dt_m == 5.0);
    CHECK(sum.largest_dt_relative == 4.0);
    CHECK(sum.largest_dt_of_tolerance == 6.0);
    CHECK(sum.coarse == 11);
    CHECK(sum.unlike_static == 22);
    CHECK(sum.wrong_index == 33);
    CHECK(sum.wrong_run == 44);
  }
  REQUIRE(a_and_b.unexplained.size() == 2);
  CHECK(a_and_b.unexplained[0].ray.t_max == 1.0);
  CHECK(a_and_b.unexplained[1].ray.t_max == 2.0);
}

TEST_CASE("the number of threads does not change a comparison") {
  const refine::TriangleMesh mesh = bed_with_needles();
  const auto candidate = std::make_shared<Spoilt>(
      mesh, [](auto&, const Hit& hit, auto&) { return hit.face % 64 == 7 ? Hit{} : hit; });
  const auto one = compare_one(mesh, candidate, 1), four = compare_one(mesh, candidate, 4);
  REQUIRE(one.size() == four.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    CHECK(one[i].rays == four[i].rays);
    CHECK(one[i].verdicts == four[i].verdicts);
    CHECK(one[i].largest_dt_m == four[i].largest_dt_m);
    REQUIRE(one[i].unexplained.size() == four[i].unexplained.size());
    for (std::size_t k = 0; k < one[i].unexplained.size(); ++k)
      CHECK(one[i].unexplained[k].ray.direction == four[i].unexplained[k].ray.direction);
  }
}

TEST_CASE("a back-end that takes fans only is compared on fans, a slow one on a share of rays") {
  const refine::TriangleMesh mesh = bed_with_needles();
  const auto whole = compare_one(mesh, std::make_shared<Spoilt>(mesh, no_fault));
  const auto fans_only = compare_one(mesh, std::make_shared<Spoilt>(mesh, no_fault, true));
  REQUIRE(whole.size() == 3);
  REQUIRE(fans_only.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) CHECK(fans_only[i].rays == whole[i].rays);

  const auto share = compare_one(mesh, std::make_shared<Spoilt>(mesh, no_fault), 2, 50);
  REQUIRE(share.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(share[i].rays == Approx(static_cast<double>(whole[i].rays) / 50.0).epsilon(0.1));
    CHECK(share[i].count(Verdict::same) == share[i].rays);
  }
}

namespace {

/// A bed of 2 x 48 x 48 faces of about 0.4 m, as rough as rocks, 18 m deep.
refine::TriangleMesh rocks() {
  constexpr std::uint32_t side = 49;
  std::vector<double> heights(side * side);
  RandomStream(9, Purpose::test).normal(heights);
  return tests::sheet(side, side, [&](double i, double j) -> Vector3d {
    return Eigen::Vector3f(
               -9.6f + 0.4f * static_cast<float>(i), -9.6f + 0.4f * static_cast<float>(j),
               static_cast<float>(-18.0 + 0.05 * heights[static_cast<std::size_t>(j * side + i)]))
        .cast<double>();
  });
}

/// A two-sided sonar that goes north over the rocks, in blocks of eight pings.
std::vector<PingBlock> rocks_track() {
  const auto grid = std::make_shared<const FanGrid>(FanLayout{.sector_low_rad = 0.2,
                                                              .sector_high_rad = 1.6,
                                                              .truncation_rad = 0.02,
                                                              .main_lobe_rad = 0.01,
                                                              .planes = 6,
                                                              .elevations = 200});
  const double c = std::cos(0.9), s = std::sin(0.9);
  std::vector<PingBlock> blocks;
  for (int block = 0; block < 4; ++block) {
    PingBlock& pings = blocks.emplace_back();
    for (int ping = 0; ping < 8; ++ping) {
      const Vector3d at(0.3 * block - 0.4, -7.0 + 3.3 * block + 0.11 * ping, -14.0);
      pings.push_back({{grid, at, {0, 1, 0}, {c, 0, -s}, {s, 0, c}, 12.0},
                       {grid, at, {0, 1, 0}, {-c, 0, -s}, {-s, 0, c}, 12.0}});
    }
  }
  return blocks;
}

/// The height of the rocks by the reference: a correct altitude.
double height_of(const Intersector& reference, double x_m, double y_m) {
  const Hit hit = hit_of(reference, {{x_m, y_m, 0.0}, {0, 0, -1}});
  return hit ? -hit.t : std::nan("");
}

/// A fault that a face source over the rocks may have.
struct Faulty {
  refine::TriangleMesh mesh = rocks();
  std::shared_ptr<const refine::ProgressiveMesh> progressive;
  std::shared_ptr<const Intersector> whole;
  double height_off_m = 0.0;

  Faulty()
      : progressive(
            std::make_shared<const refine::ProgressiveMesh>(refine::build_by_tiles(mesh, 1))),
        whole(make_intersector("pluecker", mesh)) {}
  /// A changed hierarchy.
  template <class Change>
  static Faulty hierarchy(Change change) {
    Faulty faulty;
    refine::ProgressiveMeshArrays arrays = refine::build_by_tiles(faulty.mesh, 1);
    change(arrays);
    faulty.progressive = std::make_shared<const refine::ProgressiveMesh>(std::move(arrays));
    return faulty;
  }
  static Faulty tracer(std::shared_ptr<const Intersector> whole) {
    Faulty faulty;
    faulty.whole = std::move(whole);
    return faulty;
  }

  /// Compares about 2e5 rays per face source.
  std::vector<AgreementRow> rows() const {
    const auto reference = make_intersector("pluecker", mesh);
    std::vector<Candidate> candidates;
    for (const FaceSourceKind& kind : face_source_kinds()) {
      const FaceSourceParts parts{.all = mesh,
                                  .whole = whole,
                                  .progressive = progressive,
                                  .intersector = "pluecker",
                                  .tree_pings = 6};
      const auto faces = static_cast<std::uint32_t>(mesh.faces.size());
      candidates.push_back(
          {.surface = std::string(kind.name),
           .intersector = "pluecker",
           .make = [make = kind.make, parts,
                    faces] { return std::make_unique<FacesWithBodies>(make(parts), faces, parts); },
           .precision = Precision::exact,
           .has_every_face = !kind.needs_progressive_mesh});
    }
    const HeightCandidate height{"static", "height", [&] {
                                   return [&](double x_m, double y_m) {
                                     return height_of(*reference, x_m, y_m) + height_off_m;
                                   };
                                 }};
    return compare(mesh, *reference, candidates, rocks_track(),
                   {.seed = 3,
                    .aimed_fan_rays = 50000,
                    .aimed_rays = 50000,
                    .bodies = true,
                    .heights = {height},
                    .plumb_lines = 4000,
                    .bed_faces = mesh.faces.size(),
                    .threads = 2});
  }
};

std::uint64_t unexplained(const std::vector<AgreementRow>& rows, std::string_view surface,
                          std::optional<RaySource> source = {}) {
  std::uint64_t sum = 0;
  for (const AgreementRow& row : rows)
    if (row.surface == surface && (!source || row.source == *source))
      sum += row.count(Verdict::unexplained);
  return sum;
}

/// Correct hits, but wrong runs.
class WrongRuns final : public Intersector {
 public:
  WrongRuns(refine::Triangles triangles, std::function<void(FanRuns&)> fault)
      : triangles_(triangles),
        sound_(make_intersector("pluecker", triangles)),
        fault_(std::move(fault)) {}
  void build(refine::Triangles triangles) override { sound_->build(triangles); }
  std::string_view code_path() const override { return "portable"; }
  void intersect(const RayFan& fan, std::span<Hit> hits) const override {
    sound_->intersect(fan, hits);
  }
  bool list_runs(const RayFan& fan, FanRuns& runs) const override {
    std::vector<Hit> hits(fan.grid->rays());
    sound_->intersect(fan, hits);
    runs.take(fan, triangles_, hits);
    fault_(runs);
    return true;
  }
  void intersect(std::span<const Ray> rays, std::span<Hit> hits) const override {
    sound_->intersect(rays, hits);
  }

 private:
  refine::Triangles triangles_;
  std::unique_ptr<Intersector> sound_;
  std::function<void(FanRuns&)> fault_;
};

}  // namespace

TEST_CASE("without faults 2e5 rays per face source of every kind find none") {
  const Faulty sound;
  const auto rows = sound.rows();
  std::map<std::string, std::uint64_t> rays;
  for (const AgreementRow& row : rows) {
    CAPTURE(row.surface, ray_source_names[static_cast<std::size_t>(row.source)]);
    CHECK(row.count(Verdict::same) == row.rays);
    CHECK(row.unlike_static + row.wrong_index + row.wrong_run == 0);
    CHECK(exceeded_limits(row).empty());
    rays[row.surface] += row.rays;
  }
  CHECK(rows.size() == 3 * 3 + 1 + 1);
  for (const auto& [surface, number] : rays) {
    CAPTURE(surface, number);
    CHECK(number > 120000);
    CHECK(number < 260000);
  }
  const AgreementCounts faces = compare_faces(sound.mesh, *sound.progressive, 2);
  CHECK(faces.rays == sound.mesh.faces.size());
  CHECK(faces.count(Verdict::same) == faces.rays);
}

TEST_CASE("a fault planted in a hierarchy is found by 2e5 rays, and face by face") {
  const Vector3d point(3.1, 2.2, -18.0);
  struct Planted {
    std::string name;
    std::function<void(refine::ProgressiveMeshArrays&)> fault;
  };
  const std::vector<Planted> planted{
      {"the spheres near a point halved",
       [&](refine::ProgressiveMeshArrays& arrays) {
         for (refine::Sphere& sphere : arrays.spheres)
           if ((sphere.centre.cast<double>() - point).norm() < 2.0) sphere.radius *= 0.5f;
       }},
      {"all spheres smaller by a twentieth",
       [](refine::ProgressiveMeshArrays& arrays) {
         for (refine::Sphere& sphere : arrays.spheres) sphere.radius *= 0.95f;
       }},
      {"a vertex 20 micrometres too high",
       [](refine::ProgressiveMeshArrays& arrays) { arrays.points[777].z() += 20e-6f; }},
      // Several faces, because rays do not hit every face.
      {"a few faces' corners rotated",
       [](refine::ProgressiveMeshArrays& arrays) {
         for (std::size_t slot = 1000; slot < 1020; ++slot)
           std::rotate(arrays.faces[slot].begin(), arrays.faces[slot].begin() + 1,
                       arrays.faces[slot].end());
       }},
      {"two faces' numbers swapped",
       [](refine::ProgressiveMeshArrays& arrays) {
         std::swap(arrays.source_face[1002], arrays.source_face[1500]);
       }},
  };
  for (const Planted& one : planted) {
    CAPTURE(one.name);
    const Faulty faulty = Faulty::hierarchy(one.fault);
    const auto rows = faulty.rows();
    CHECK(unexplained(rows, "static") == 0);
    // The active mesh takes a face's corner order from its vertices.
    if (one.name != "a few faces' corners rotated") CHECK(unexplained(rows, "refined") > 0);
    CHECK(unexplained(rows, "footprint") > 0);
    CHECK(compare_faces(faulty.mesh, *faulty.progressive, 2).count(Verdict::unexplained) > 0);
  }

  // The active mesh itself notices a missing face.
  const Faulty dropped = Faulty::hierarchy([](refine::ProgressiveMeshArrays& arrays) {
    arrays.faces[1002].fill(refine::ProgressiveMesh::none);
    arrays.source_face[1002] = refine::ProgressiveMesh::none;
  });
  CHECK(compare_faces(dropped.mesh, *dropped.progressive, 2).count(Verdict::unexplained) == 1);
  CHECK_THROWS_AS(dropped.rows(), refine::DamagedFile);
}

TEST_CASE("a fault planted in runs, indices, ties or altitudes is found by 2e5 rays") {
  const refine::TriangleMesh mesh = rocks();
  const auto in_scene = [](const Faulty& faulty) {
    return unexplained(faulty.rows(), "static", RaySource::scene);
  };
  // Every boundary between two runs moved by one ray, then a single one.
  CHECK(in_scene(Faulty::tracer(std::make_shared<WrongRuns>(mesh, [](FanRuns& runs) {
          for (std::size_t i = 0; i + 1 < runs.size(); ++i)
            if (runs.end[i] == runs.begin[i + 1]) ++runs.end[i], ++runs.begin[i + 1];
        }))) > 1000);
  CHECK(in_scene(Faulty::tracer(std::make_shared<WrongRuns>(mesh, [](FanRuns& runs) {
          if (runs.size() > 7) --runs.end[7];
        }))) > 10);
  CHECK(in_scene(Faulty::tracer(std::make_shared<WrongRuns>(mesh, [](FanRuns& runs) {
          for (std::size_t i = 0; i < runs.size(); ++i) runs.distance[i] *= 1.0 + 1e-9;
        }))) > 1000);
  CHECK(in_scene(Faulty::tracer(std::make_shared<Spoilt>(mesh, [](auto&, Hit hit, auto&) {
          return hit.face % 512 == 7 ? hit.index ^= 1u, hit : hit;
        }))) > 0);

  // Each face twice: the reference hits the first, a face source the second.
  Faulty ties;
  ties.mesh.faces.insert(ties.mesh.faces.end(), mesh.faces.begin(), mesh.faces.end());
  const auto faces = static_cast<std::uint32_t>(mesh.faces.size());
  ties.progressive = make_progressive_mesh(ties.mesh);
  ties.whole = std::make_shared<Spoilt>(ties.mesh, [=](auto&, Hit hit, auto&) {
    return hit ? hit.index = hit.face += faces, hit : hit;
  });
  CHECK(in_scene(ties) > 1000);
  // An intersector in float may do so, but only on its allowed share of rays.
  for (const AgreementRow& row : compare_one(ties.mesh, ties.whole)) {
    CHECK(row.count(Verdict::unexplained) == 0);
    if (row.source == RaySource::scene)
      CHECK(exceeded_limits(row) == std::vector<std::string_view>{"tie"});
  }

  Faulty higher;
  higher.height_off_m = 1e-9;
  CHECK(unexplained(higher.rows(), "static", RaySource::plumb_lines) > 3000);
}

TEST_CASE(
    "float errors of a fan far from the origin are no rounding, and a ray from afar is coarse") {
  refine::TriangleMesh far = rocks();
  std::vector<PingBlock> blocks = rocks_track();
  for (Eigen::Vector3f& position : far.positions) position.x() += 50000.0f;
  for (PingBlock& block : blocks)
    for (auto& ping : block)
      for (RayFan& fan : ping) fan.origin.x() += 50000.0;
  const auto reference = make_intersector("pluecker", far);
  // A fan in float whose coordinates are not shifted to the mesh.
  const auto rounded = std::make_shared<Spoilt>(far, [&](auto& ray, const Hit& hit, auto& sound) {
    Ray coarse = ray;
    coarse.origin = in_float(ray.origin);
    return hit ? hit_of(sound, coarse) : hit;
  });
  const Candidate one{.surface = "static", .intersector = "candidate", .make = [&] {
                        return static_faces(far, rounded);
                      }};
  const auto rows = compare(far, *reference, {&one, 1}, blocks, {});
  REQUIRE(rows.size() == 1);
  CHECK(rows[0].count(Verdict::unexplained) > 1000);

  // Rounding depends on the ray's distance from the mesh, not from the origin of coordinates.
  const Judge judge(far, *reference);
  const Vector3d target(50001.0, 0.5, -18.0), origin = target + Vector3d(-49000.0, 0.0, 9000.0);
  const Ray ray{origin, (target - origin).normalized()};
  const Hit hit = hit_of(*reference, ray);
  REQUIRE(hit);
  CHECK(judge.is_coarse(ray, hit.face, Precision::in_float));
  CHECK(!judge.is_coarse(ray, hit.face, Precision::in_double));
  CHECK(!judge.is_coarse({target + Vector3d(-5.0, 0.0, 4.0), {5.0, 0.0, -4.0}}, hit.face,
                         Precision::in_float));
}

TEST_CASE("aimed rays hit vertices and edges, and are the same for the same seed") {
  const refine::TriangleMesh mesh = bed_with_needles();
  const auto tracer = make_intersector("pluecker", mesh);
  const AdversarialRays aimed(mesh, 11), again(mesh, 11), other(mesh, 12);
  std::vector<Ray> rays(4096), same(4096), different(4096);
  aimed.aim(3, rays);
  again.aim(3, same);
  other.aim(3, different);
  std::size_t hits = 0, on_edges = 0, equal = 0;
  const auto look = [&](const Ray& ray, const Hit& hit) {
    CHECK_NOTHROW(check_ray(ray));
    hits += static_cast<bool>(hit);
    on_edges += hit && std::min({hit.u, hit.v, 1.0 - hit.u - hit.v}) < 1e-9;
  };
  for (std::size_t i = 0; i < rays.size(); ++i) {
    CHECK(rays[i].origin == same[i].origin);
    CHECK(rays[i].direction == same[i].direction);
    equal += rays[i].direction == different[i].direction;
    look(rays[i], hit_of(*tracer, rays[i]));
  }
  CHECK(equal == 0);
  CHECK(hits > rays.size() / 2);
  CHECK(on_edges > hits / 2);

  hits = on_edges = 0;
  for (std::uint64_t number = 0; number < 20; ++number) {
    const RayFan fan = aimed.aim(number, *tracer);
    CHECK(fan.grid->sin_elevation == again.aim(number, *tracer).grid->sin_elevation);
    CHECK(std::ranges::is_sorted(fan.grid->elevation_rad));
    std::vector<Hit> found(fan.grid->rays());
    tracer->intersect(fan, found);
    for (std::size_t i = 0; i < found.size(); ++i)
      look(fan.ray(i / fan.elevations(), i % fan.elevations()), found[i]);
  }
  CHECK(hits > 2000);
  CHECK(on_edges > hits / 20);
  // An error in the axes' length appears twice in the ranges of a back-end in the fan's frame.
  for (std::uint64_t number = 0; number < 500; ++number) {
    const RayFan fan = aimed.aim(number, *tracer);
    for (const Vector3d& axis : {fan.array_axis, fan.middle, fan.pole})
      CHECK(axis.squaredNorm() == Approx(1.0).epsilon(0.0).margin(2e-15));
  }
  CHECK_THROWS_AS(AdversarialRays({}, 1), std::invalid_argument);
}
