// Tests that the comparison of bent rays finds faults: each fault is planted in what a run would
// trace with, and 2e5 rays must find the fault.

#include <ensonify/engine/trace/check/bent_rays.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "engine/trace/thermocline.h"
#include "support/catch.h"
#include "support/meshes.h"

#include <ensonify/engine/trace/check/agreement.h>
#include <ensonify/engine/trace/face_sources/static_faces.h>
#include <ensonify/engine/trace/refraction/bent_ranges.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;
using ensonify::tests::thermocline;
using scatter::SoundSpeedProfile;

namespace {

constexpr double mps = 1500.0, range_m = 25.0;

/// A wavy bed of 2 x 60 x 60 faces of about 0.7 m, 14 to 15 m deep.
refine::TriangleMesh waves() {
  return tests::sheet(61, 61, [](double x, double y) {
    return Vector3d(0.7 * x - 21.0, 0.7 * y - 21.0,
                    -14.5 + 0.2 * std::sin(0.9 * x) * std::cos(0.7 * y) + 0.2 * std::sin(0.3 * x));
  });
}

/// About 1e5 rays, as `check --rays 2e5` takes them of a scene: a two-sided sonar that goes north.
std::vector<PingBlock> track() {
  const auto grid = std::make_shared<const FanGrid>(FanLayout{.sector_low_rad = 0.3,
                                                              .sector_high_rad = 1.5,
                                                              .truncation_rad = 0.05,
                                                              .main_lobe_rad = 0.02,
                                                              .planes = 6,
                                                              .elevations = 230});
  const double c = std::cos(grid->middle_depression_rad), s = std::sin(grid->middle_depression_rad);
  const FanBend bend = bend_of(thermocline, 15.0, range_m, mps);
  std::vector<PingBlock> blocks;
  for (int block = 0; block < 4; ++block)
    for (int ping = 0; ping < 5; ++ping) {
      const Vector3d at(0.2, -10.0 + 5.0 * block + 0.9 * ping, -3.0);
      if (ping == 0) blocks.emplace_back();
      blocks.back().push_back({{grid, at, {0, 1, 0}, {c, 0, -s}, {s, 0, c}, range_m, bend},
                               {grid, at, {0, 1, 0}, {-c, 0, -s}, {-s, 0, c}, range_m, bend}});
    }
  return blocks;
}

/// What a run traces bent rays with; each part may have a fault.
struct Traced {
  refine::TriangleMesh mesh = waves();
  SoundSpeedProfile profile = thermocline;
  double reference_mps = mps;
};

/// Compares the bent rays with the reference's over waves() under the thermocline.
AgreementRow compare_bent(const Traced& traced) {
  const refine::TriangleMesh mesh = waves();
  const auto reference = make_intersector("pluecker", mesh);
  const double highest_m = refine::bounds(mesh).highest.z();
  const FaceSourceParts parts{.all = traced.mesh,
                              .whole = make_intersector("pluecker", traced.mesh),
                              .intersector = "pluecker"};
  const Candidate one{.surface = "static",
                      .intersector = "pluecker",
                      .make =
                          [&] {
                            return std::make_unique<FacesWithBodies>(
                                make_static_faces(parts),
                                static_cast<std::uint32_t>(mesh.faces.size()), parts);
                          },
                      .make_bent =
                          [&] {
                            return std::make_unique<RefractedTracer>(traced.profile, highest_m,
                                                                     15.0, traced.reference_mps);
                          }};
  const auto rows =
      compare(mesh, *reference, {&one, 1}, track(),
              {.water = {&thermocline, highest_m, mps}, .bent_every = 5, .threads = 2});
  REQUIRE(rows.size() == 2);
  REQUIRE(rows[1].source == RaySource::bent);
  return rows[1];
}

}  // namespace

TEST_CASE("without a fault the bent rays of 2e5 rays hit what the reference hits") {
  const AgreementRow row = compare_bent({});
  INFO("largest difference " << row.largest_dt_m << " m");
  CHECK(row.rays > 15000);
  CHECK(row.rays < 25000);
  CHECK(row.count(Verdict::same) > 0.999 * static_cast<double>(row.rays));
  CHECK(row.count(Verdict::unexplained) == 0);
  CHECK(row.wrong_index == 0);
  CHECK(exceeded_limits(row).empty());
  CHECK(row.largest_dt_m > 0.0);
  CHECK(row.largest_dt_m < 5e-5);
}

TEST_CASE("a fault planted in the tracing of bent rays is found by 2e5 rays") {
  struct Planted {
    std::string name;
    Traced traced;
  };
  std::vector<Planted> planted(5);
  planted[0].name = "the sound speed of one layer off by 1 m/s";
  planted[0].traced.profile = SoundSpeedProfile({{0, 1520}, {6, 1520}, {10, 1491}, {60, 1490.5}});
  planted[1].name = "rays bent by a twentieth less";  // about the mean speed: times stay
  planted[1].traced.profile =
      SoundSpeedProfile({{0, 1519.2}, {6, 1519.2}, {10, 1490.7}, {60, 1491.2}});
  planted[2].name = "a layer 5 cm too deep";
  planted[2].traced.profile =
      SoundSpeedProfile({{0, 1520}, {6.05, 1520}, {10.05, 1490}, {60, 1490.5}});
  planted[3].name = "a vertex a millimetre too high";
  planted[3].traced.mesh.positions[30 * 61 + 45].z() += 1e-3f;
  planted[4].name = "the reference speed off by 0.1 m/s";
  planted[4].traced.reference_mps += 0.1;
  for (const Planted& one : planted) {
    CAPTURE(one.name);
    const AgreementRow row = compare_bent(one.traced);
    CHECK(row.count(Verdict::unexplained) > 0);
  }
}

TEST_CASE("a hit of a bent ray is judged by what rays a millimetre beside it hit") {
  const SoundSpeedProfile even({{0, 1500}});
  const refine::TriangleMesh square{
      .positions = {{0, 0, -10}, {2, 0, -10}, {2, 2, -10}, {0, 2, -10}},
      .faces = {{0, 1, 2}, {0, 2, 3}}};
  const auto exact = make_intersector("pluecker", square);
  const BentReference reference({&even, -10.0, mps}, square, *exact);
  const auto verdict = [&](double x_m, double y_m, double end_m, const Hit& found) {
    const Ray down{{x_m, y_m, -2.0}, {0, 0, -1}, 0.0, end_m};
    return reference.judge({0, down, reference.trace(down)}, found);
  };
  const Hit miss;
  CHECK(verdict(1.5, 0.5, 20.0, {0, 0, 8.0, 0.5, 0.25}) == Verdict::same);
  CHECK(verdict(1.5, 0.5, 20.0, {0, 0, 8.00005, 0.5, 0.25}) == Verdict::same);
  CHECK(verdict(1.5, 0.5, 20.0, {0, 0, 8.0002, 0.5, 0.25}) == Verdict::unexplained);
  CHECK(verdict(1.5, 0.5, 20.0, miss) == Verdict::unexplained);
  CHECK(verdict(2.5, 0.5, 20.0, miss) == Verdict::same);
  CHECK(verdict(1.0, 0.9998, 20.0, {1, 1, 8.0, 0.5, 0.0}) == Verdict::tie);
  CHECK(verdict(1.0, 0.9998, 20.0, {1, 1, 8.1, 0.5, 0.0}) == Verdict::unexplained);
  CHECK(verdict(1.0, 0.99, 20.0, {1, 1, 8.0, 0.5, 0.0}) == Verdict::unexplained);
  CHECK(verdict(1.5, 0.5, 8.0005, miss) == Verdict::end);
  CHECK(verdict(1.5, 0.5, 8.01, miss) == Verdict::unexplained);
  CHECK(verdict(2.0005, 0.5, 20.0, {0, 0, 8.0, 1.0, 0.25}) == Verdict::edge);
  CHECK(verdict(1.9995, 0.5, 20.0, miss) == Verdict::edge);
  CHECK(verdict(1.998, 0.5, 20.0, miss) == Verdict::unexplained);
}
