#include <ensonify/engine/trace/refraction/refracted_tracer.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/trace/thermocline.h"
#include "support/beds.h"
#include "support/catch.h"
#include "support/heights.h"
#include "support/meshes.h"
#include "support/targets.h"

#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/engine/trace/refraction/bent_ranges.h>
#include <ensonify/engine/trace/refraction/travel_time.h>

using namespace ensonify;
using namespace ensonify::engine;
using ensonify::tests::thermocline;

namespace {

const scatter::SoundSpeedProfile duct(
    {{1.81, 1481.35}, {3.35, 1476.16}, {5, 1475.21}, {9.76, 1478.1}, {30, 1482}});

/// A rough bed about 15 m deep, with boxes on it and floating over it.
Seafloor bed_with_boxes() {
  Seafloor bed;
  constexpr int n = 160;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x)
      bed.mesh.positions.emplace_back(0.5f * x - 10.0f, 0.5f * y - 40.0f,
                                      -15.0f + 0.3f * std::sin(0.9f * x) * std::cos(0.7f * y) +
                                          0.5f * std::sin(0.11f * x + 0.2f * y));
  for (std::uint32_t y = 0; y < n; ++y)
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
      bed.mesh.faces.push_back({a, b, d});
      bed.mesh.faces.push_back({a, d, c});
    }
  bed.bed_faces = bed.mesh.faces.size();
  bed.labels = {{1, 1, 0}};
  tests::add_box(bed, {20, -6, -15.5}, {23, 6, -12});
  tests::add_box(bed, {35, -8, -12.5}, {38, 8, -11.5});
  return bed;
}

RayFan fan_at(const Eigen::Vector3d& origin, int elevations, double range_m) {
  auto grid = std::make_shared<const FanGrid>(FanLayout{.sector_low_rad = -0.1,
                                                        .sector_high_rad = 1.5,
                                                        .truncation_rad = 0.05,
                                                        .main_lobe_rad = 0.05,
                                                        .planes = 4,
                                                        .elevations = elevations,
                                                        .range_over_height = 8});
  const double c = std::cos(grid->middle_depression_rad), s = std::sin(grid->middle_depression_rad);
  return {grid, origin, {0, 1, 0}, {c, 0, -s}, {s, 0, c}, range_m};
}

/// The first hit of a ray's chords of 2 cm from its source on; none beyond the range.
Hit reference(const scatter::SoundSpeedProfile& profile, const Intersector& pluecker,
              const Ray& launch, double range_m, double reference_mps) {
  const Eigen::Vector3d d = launch.direction;
  scatter::SoundRay ray(profile, -launch.origin.z(), d.head<2>().norm(), -d.z());
  const Eigen::Vector2d level = d.head<2>().normalized();
  const auto place = [&] {
    const auto& p = ray.point();
    return Eigen::Vector3d(launch.origin.x() + p.range_m * level.x(),
                           launch.origin.y() + p.range_m * level.y(), -p.depth_m);
  };
  while (reference_mps * ray.point().time_s < range_m) {
    const Eigen::Vector3d from = place();
    const double time_s = ray.point().time_s;
    ray.advance(std::min(0.02, ray.path_to_edge_m()));
    const Ray chord{from, place() - from, 0.0, 1.0};
    if (chord.direction.norm() == 0.0) continue;
    Hit hit;
    pluecker.intersect({&chord, 1}, {&hit, 1});
    if (!hit) continue;
    hit.t = reference_mps * (time_s + hit.t * (ray.point().time_s - time_s));
    return hit.t <= range_m ? hit : Hit{};
  }
  return {};
}

/// Compares the faces and times of a fan's rays with the reference's, except for rays that are
/// within a millimetre of the expected face.
void compare_with_reference(const scatter::SoundSpeedProfile& profile, double depth_m,
                            int elevations) {
  const Seafloor bed = bed_with_boxes();
  const auto pluecker = make_intersector("pluecker", bed.mesh);
  const auto embree = make_intersector("embree", bed.mesh);
  RayFan fan = fan_at({0, 0, -depth_m}, elevations, 60.0);
  fan.bend = bend_of(profile, 16.5, fan.range_m, 1490.0);
  RefractedTracer tracer(profile, refine::bounds(bed.mesh).highest.z(), 16.5, 1490.0);
  std::vector<Hit> hits(fan.grid->rays());
  tracer.trace(fan, {embree.get(), bed.mesh}, hits);
  CHECK(tracer.counts().chords < 40 * tracer.counts().rays);
  int same = 0, hit_count = 0, near_edge = 0, unexplained = 0;
  for (std::size_t k = 0; k < fan.planes(); ++k)
    for (std::size_t j = 0; j < fan.elevations(); ++j) {
      if (!fan.grid->within_beam(k, j)) continue;
      Hit& found = hits[k * fan.elevations() + j];
      const Ray ray = fan.ray(k, j);
      const Hit expected = reference(profile, *pluecker, ray, fan.range_m, 1490.0);
      hit_count += static_cast<bool>(expected);
      if (found.face == expected.face) {
        ++same;
        if (!found) continue;
        const RayIncidence at = tracer.incidence_of(k * fan.elevations() + j, found);
        CHECK(found.t == Approx(expected.t).margin(2e-3));
        const refine::Face& face = bed.mesh.faces[found.face];
        const Eigen::Vector3d a = bed.mesh.positions[face[0]].cast<double>();
        const Eigen::Vector3d b = bed.mesh.positions[face[1]].cast<double>();
        const Eigen::Vector3d c = bed.mesh.positions[face[2]].cast<double>();
        CHECK(std::abs((b - a).cross(c - a).normalized().dot(at.place - a)) < 1e-4);
        continue;
      }
      const double t = std::min(found ? found.t : 1e9, expected ? expected.t : 1e9);
      const Eigen::Vector3d across = ray.direction.unitOrthogonal();
      bool near = (found && expected && std::abs(found.t - expected.t) < 1e-3) ||
                  std::abs(t - fan.range_m) < 1e-3;
      for (const Eigen::Vector3d& way :
           {across, Eigen::Vector3d(-across), Eigen::Vector3d(ray.direction.cross(across)),
            Eigen::Vector3d(across.cross(ray.direction))}) {
        Ray beside = ray;
        beside.direction = (ray.direction + 1e-3 / t * way).normalized();
        near =
            near || reference(profile, *pluecker, beside, fan.range_m, 1490.0).face == found.face;
      }
      ++(near ? near_edge : unexplained);
      if (!near)
        WARN("plane " << k << ", ray " << j << ": " << found.t << " m to face " << found.face
                      << ", not " << expected.t << " m to " << expected.face);
    }
  CAPTURE(depth_m, same, near_edge, hit_count);
  CHECK(hit_count > 2 * elevations);
  CHECK(unexplained == 0);
  CHECK(near_edge <= 1 + hit_count / 300);
}

}  // namespace

TEST_CASE("Bent rays hit the faces that their finest chords hit, at the same time") {
  for (const scatter::SoundSpeedProfile* profile : {&thermocline, &duct})
    for (const double depth_m : {4.0, 8.0, 11.7})  // above all faces, most bent, and among them
      compare_with_reference(*profile, depth_m, 250);
}

TEST_CASE("Ten times as many bent rays hit the faces that their finest chords hit", "[.soak]") {
  for (const scatter::SoundSpeedProfile* profile : {&thermocline, &duct})
    for (const double depth_m : {4.0, 6.7, 8.0, 9.3, 11.7})
      compare_with_reference(*profile, depth_m, 2500);
}

TEST_CASE("A tracer hits a second surface as a new tracer does") {
  const Seafloor bed = bed_with_boxes();
  Seafloor before = bed;  // the same faces at other places of the list
  std::ranges::reverse(before.mesh.faces);
  RayFan fan = fan_at({0, 0, -8.0}, 250, 60.0);
  fan.bend = bend_of(thermocline, 16.5, fan.range_m, 1490.0);
  const float highest_m = refine::bounds(bed.mesh).highest.z();
  RefractedTracer used(thermocline, highest_m, 16.5, 1490.0, false);
  RefractedTracer fresh(thermocline, highest_m, 16.5, 1490.0, false);
  std::vector<Hit> first(fan.grid->rays()), again = first, expected = first;
  used.trace(fan, {nullptr, before.mesh}, first);
  used.trace(fan, {nullptr, bed.mesh, 1}, again);
  fresh.trace(fan, {nullptr, bed.mesh}, expected);
  std::size_t hit_count = 0, different = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    hit_count += static_cast<bool>(expected[i]);
    different += again[i].face != expected[i].face || again[i].t != expected[i].t;
  }
  CHECK(hit_count > 500);
  CHECK(different == 0);
}

TEST_CASE("Bent rays have the same hits on every instruction set") {
  const Seafloor bed = bed_with_boxes();
  RayFan fan = fan_at({0, 0, -8.0}, 250, 60.0);
  fan.bend = bend_of(thermocline, 16.5, fan.range_m, 1490.0);
  const float highest_m = refine::bounds(bed.mesh).highest.z();
  std::vector<Hit> expected;
  tests::on_each_target([&] {
    RefractedTracer tracer(thermocline, highest_m, 16.5, 1490.0, false);
    std::vector<Hit> hits(fan.grid->rays());
    tracer.trace(fan, {nullptr, bed.mesh}, hits);
    if (expected.empty()) expected = hits;
    std::size_t hit_count = 0, different = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      hit_count += static_cast<bool>(hits[i]);
      different += hits[i].face != expected[i].face || hits[i].t != expected[i].t;
    }
    CHECK(hit_count > 500);
    CHECK(different == 0);
  });
}

TEST_CASE("A bed of heights with objects gives the hits of all their faces, to the bit") {
  tests::Random random(3);
  tests::Heights heights{321, 321, 0.25, {}};
  for (int y = 0; y < heights.rows; ++y)
    for (int x = 0; x < heights.columns; ++x)
      heights.z_m.push_back(-15.0 + 0.1 * std::sin(0.45 * x) * std::cos(0.35 * y) +
                            0.5 * std::sin(0.055 * x + 0.1 * y) +
                            0.02 * tests::uniform(random, -1.0, 1.0));
  const refine::HeightGrid grid = heights.grid();
  Seafloor all;
  all.mesh = grid.mesh();
  const auto bed_faces = static_cast<std::uint32_t>(all.mesh.faces.size());
  Seafloor boxes;
  for (Seafloor* to : {&all, &boxes}) {
    tests::add_box(*to, {-5, -6, -15.5}, {-3, 6, -13});
    tests::add_box(*to, {12, -20, -14}, {14, 20, -13.5});
  }
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < boxes.mesh.faces.size(); ++i) numbers.push_back(bed_faces + i);
  const refine::Triangles objects{boxes.mesh.positions, boxes.mesh.faces, numbers};
  class AllFaces final : public FaceSource {
   public:
    explicit AllFaces(refine::Triangles triangles) : triangles_(triangles) {}
    Faces prepare(std::span<const RayFan>) override { return {nullptr, triangles_, 2}; }

   private:
    refine::Triangles triangles_;
  };
  AllFaces source(all.mesh);
  const float highest_m = refine::bounds(all.mesh).highest.z();
  const scatter::SoundSpeedProfile strong({{0, 1480}, {10, 1520}, {60, 1525}});

  int on_bed = 0, on_all_faces = 0;
  std::size_t hit_count = 0, on_objects = 0, different = 0;
  for (const scatter::SoundSpeedProfile* profile : {&thermocline, &duct, &strong}) {
    RefractedTracer by_faces(*profile, highest_m, 16.5, 1490.0, false);
    RefractedTracer by_grid(*profile, highest_m, 16.5, 1490.0, false);
    for (int number = 0; number < 24; ++number) {
      RayFan fan = fan_at({tests::uniform(random, -20.0, 5.0), tests::uniform(random, -10.0, 10.0),
                           tests::uniform(random, -12.0, -5.0)},
                          400, number % 3 == 0 ? 15.0 : 45.0);
      const Eigen::Quaterniond turn(
          Eigen::AngleAxisd(tests::uniform(random, -3.0, 3.0), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(number % 4 == 0 ? 0.0 : tests::uniform(random, -0.1, 0.1),
                            Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(tests::uniform(random, -0.1, 0.1), Eigen::Vector3d::UnitY()));
      for (Eigen::Vector3d* axis : {&fan.array_axis, &fan.middle, &fan.pole}) *axis = turn * *axis;
      fan.bend = bend_of(*profile, 16.5, fan.range_m, 1490.0);
      CAPTURE(number, fan.origin.transpose());
      std::vector<Hit> expected(fan.grid->rays()), found = expected;
      by_faces.trace(fan, {nullptr, all.mesh}, expected);
      TracedFaces traced = BedAndObjects{&grid, {nullptr, objects, 1}, &source, {&fan, 1}};
      by_grid.trace(fan, traced, found);
      ++(std::holds_alternative<Faces>(traced) ? on_all_faces : on_bed);
      for (std::size_t i = 0; i < found.size(); ++i) {
        const bool same = found[i].face == expected[i].face && found[i].t == expected[i].t;
        different += !same;
        if (!same || !found[i]) continue;
        ++hit_count;
        on_objects += found[i].face >= bed_faces;
        CHECK(by_grid.triangles().number(found[i].index) == found[i].face);
        const RayIncidence a = by_faces.incidence_of(i, expected[i]);
        const RayIncidence b = by_grid.incidence_of(i, found[i]);
        different += found[i].t != expected[i].t || a.place != b.place ||
                     a.direction != b.direction || a.spreading_m2 != b.spreading_m2 ||
                     a.absorption_db != b.absorption_db || a.upwards != b.upwards;
      }
    }
  }
  CHECK(on_bed > 40);
  CHECK(on_all_faces > 0);
  CHECK(hit_count > 30'000);
  CHECK(on_objects > 1'000);
  CHECK(different == 0);
}

TEST_CASE("Faces that a fan cannot touch change no hit of its bent rays, nor which need chords") {
  // Rays need chords if something in the fan is higher than the sonar, or if no known ray reaches a
  // part of a face there.
  Seafloor bed = bed_with_boxes();
  tests::Random random(4);
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3f low(static_cast<float>(tests::uniform(random, 3.0, 60.0)),
                              static_cast<float>(tests::uniform(random, -35.0, 35.0)),
                              static_cast<float>(tests::uniform(random, -8.0, -3.0)));
    tests::add_box(bed, low, low + Eigen::Vector3f::Constant(0.4f));
  }
  const float highest_m = refine::bounds(bed.mesh).highest.z();
  std::size_t hit_count = 0, different = 0, left_out = 0;
  std::uint64_t some_chords = 0, other_ways = 0;
  for (const scatter::SoundSpeedProfile* profile : {&thermocline, &duct}) {
    RefractedTracer with_all(*profile, highest_m, 16.5, 1490.0, false);
    RefractedTracer with_few(*profile, highest_m, 16.5, 1490.0, false);
    std::uint64_t version = 0;
    for (int number = 0; number < 100; ++number) {
      RayFan fan = fan_at({tests::uniform(random, -5.0, 5.0), tests::uniform(random, -20.0, 20.0),
                           tests::uniform(random, -8.0, -4.0)},
                          50, 50.0);
      const Eigen::AngleAxisd turn(tests::uniform(random, -1.0, 1.0), Eigen::Vector3d::UnitZ());
      for (Eigen::Vector3d* axis : {&fan.array_axis, &fan.middle, &fan.pole}) *axis = turn * *axis;
      fan.bend = bend_of(*profile, 16.5, fan.range_m, 1490.0);
      // The fewest faces that a query may give, in another order.
      const refine::FanVolume volume = fan_volume_of(fan);
      const refine::ViewTest test(std::span(&volume, 1));
      std::vector<refine::Face> faces;
      std::vector<std::uint32_t> numbers;
      for (auto i = static_cast<std::uint32_t>(bed.mesh.faces.size()); i-- > 0;) {
        const refine::Triangles all(bed.mesh);
        const Eigen::Vector3d a = all.corner(i, 0), b = all.corner(i, 1), c = all.corner(i, 2);
        const Eigen::Vector3d middle = (a + b + c) / 3.0;
        const double radius =
            1.000001 * std::max({(a - middle).norm(), (b - middle).norm(), (c - middle).norm()});
        if (!test.touches({middle.cast<float>(), static_cast<float>(radius)})) continue;
        faces.push_back(bed.mesh.faces[i]);
        numbers.push_back(i);
      }
      left_out += bed.mesh.faces.size() - faces.size();
      std::vector<Hit> expected(fan.grid->rays()), found = expected;
      const RefractionCounts all_before = with_all.counts(), few_before = with_few.counts();
      with_all.trace(fan, {nullptr, bed.mesh}, expected);
      with_few.trace(fan, {nullptr, {bed.mesh.positions, faces, numbers}, ++version}, found);
      const RefractionCounts all = with_all.counts() - all_before,
                             few = with_few.counts() - few_before;
      some_chords += all.straightened > 0 && all.chords > 0;
      other_ways += all.straightened != few.straightened || all.chords != few.chords;
      for (std::size_t i = 0; i < found.size(); ++i) {
        hit_count += static_cast<bool>(expected[i]);
        different += found[i].face != expected[i].face || found[i].t != expected[i].t;
        if (!expected[i] || found[i].face != expected[i].face) continue;
        const RayIncidence a = with_all.incidence_of(i, expected[i]),
                           b = with_few.incidence_of(i, found[i]);
        different += found[i].t != expected[i].t || a.place != b.place ||
                     a.direction != b.direction || a.spreading_m2 != b.spreading_m2;
      }
    }
  }
  CHECK(hit_count > 10'000);
  CHECK(left_out > 10'000);
  CHECK(some_chords > 10);
  CHECK(other_ways == 0);
  CHECK(different == 0);
}

TEST_CASE("Faces are flat in straightened space within half a millimetre") {
  // A hit's time before it is exact is that of the flat part. The distance of the two, across the
  // face, is how far the face is from flat there.
  for (const Seafloor& bed : {bed_with_boxes(), tests::level_bed(15.0, 100.0)})
    for (const double depth_m : {4.0, 6.7, 8.0}) {
      RayFan fan = fan_at({0, 0, -depth_m}, 1000, 60.0);
      fan.bend = bend_of(thermocline, 16.5, fan.range_m, 1490.0);
      RefractedTracer tracer(thermocline, refine::bounds(bed.mesh).highest.z(), 16.5, 1490.0);
      const auto embree = make_intersector("embree", bed.mesh);
      std::vector<Hit> hits(fan.grid->rays());
      tracer.trace(fan, {embree.get(), bed.mesh}, hits);
      double worst_m = 0.0;
      int looked = 0;
      for (std::size_t i = 0; i < hits.size(); ++i) {
        if (!hits[i]) continue;
        Hit exact = hits[i];
        const RayIncidence at = tracer.incidence_of(i, exact);
        const Eigen::Vector3d launch =
            fan.direction(fan.plane_direction(i / fan.elevations()), i % fan.elevations());
        const refine::Triangles triangles(bed.mesh);
        const Eigen::Vector3d a = triangles.corner(exact.index, 0);
        const Eigen::Vector3d normal = (triangles.corner(exact.index, 1) - a)
                                           .cross(triangles.corner(exact.index, 2) - a)
                                           .normalized();
        worst_m = std::max(
            worst_m, std::abs((exact.t - hits[i].t) * at.straightened(normal, launch).dot(launch)));
        ++looked;
      }
      CAPTURE(depth_m, bed.mesh.faces.size());
      CHECK(looked > 3000);
      CHECK(worst_m < 0.5e-3);
    }
}

TEST_CASE("Everything that a bent fan can touch is in its fan volume") {
  const Seafloor bed = bed_with_boxes();
  const double highest_m = refine::bounds(bed.mesh).highest.z();
  const auto embree = make_intersector("embree", bed.mesh);
  RayFan fan = fan_at({0, 0, -4.0}, 250, 60.0);
  fan.bend = bend_of(thermocline, 17.0, fan.range_m, 1490.0);
  CHECK(fan.bend.turn_rad > 0.0);
  const refine::FanVolume volume = fan_volume_of(fan);
  const refine::ViewTest test(std::span(&volume, 1));
  RefractedTracer tracer(thermocline, highest_m, 16.5, 1490.0);
  std::vector<Hit> hits(fan.grid->rays());
  tracer.trace(fan, {embree.get(), bed.mesh}, hits);
  for (std::size_t i = 0; i < hits.size(); ++i)
    if (hits[i]) CHECK(test.touches({tracer.incidence_of(i, hits[i]).place.cast<float>(), 0.0f}));
}

TEST_CASE(
    "In the straightened space of a bent fan a face is where its neighbours' times place it") {
  // Two rays to one plane: the straightened normal predicts the second's time from the first's.
  const Seafloor bed = tests::level_bed(15.0);
  const auto embree = make_intersector("embree", bed.mesh);
  RayFan fan = fan_at({0, 0, -4.0}, 2000, 60.0);
  fan.bend = bend_of(thermocline, 15.0, fan.range_m, 1490.0);
  RefractedTracer tracer(thermocline, -15.0, 15.0, 1490.0);
  std::vector<Hit> hits(fan.grid->rays());
  tracer.trace(fan, {embree.get(), bed.mesh}, hits);
  int looked = 0;
  const std::size_t k = 2, first = k * fan.elevations();
  for (std::size_t j = 0; j + 1 < fan.elevations(); ++j) {
    if (!hits[first + j] || !hits[first + j + 1]) continue;
    const Eigen::Vector3d here = fan.ray(k, j).direction, there = fan.ray(k, j + 1).direction;
    Hit near = hits[first + j], next = hits[first + j + 1];
    const Eigen::Vector3d normal =
        tracer.incidence_of(first + j, near).straightened({0, 0, 1}, here);
    tracer.incidence_of(first + j + 1, next);
    const double predicted_m = near.t * normal.dot(here) / normal.dot(there);
    CHECK(predicted_m == Approx(next.t).epsilon(1e-3));
    ++looked;
  }
  CHECK(looked > 1000);
}

TEST_CASE("A step in straightened space leads to where, and as, the neighbouring ray arrives") {
  const Seafloor bed = tests::level_bed(15.0);
  const auto embree = make_intersector("embree", bed.mesh);
  // Checks two rays that hit neighbouring places, with the mean of what both say of the step.
  double worst_way = 0.0, worst_turn = 0.0;
  int looked = 0, crossed = 0;
  const auto compare_neighbours = [&](const RayFan& fan, IncidenceSource& source,
                                      std::span<const Hit> hits) {
    for (std::size_t i = 0; i + 1 < hits.size(); ++i) {
      if ((i + 1) % fan.elevations() == 0 || !hits[i] || !hits[i + 1]) continue;
      const Eigen::Vector3d in_plane = fan.plane_direction(i / fan.elevations());
      const std::size_t elevation = i % fan.elevations();
      const Eigen::Vector3d here = fan.direction(in_plane, elevation),
                            there = fan.direction(in_plane, elevation + 1);
      Hit hit = hits[i], next_hit = hits[i + 1];
      const RayIncidence at = source.incidence_of(i, hit),
                         next = source.incidence_of(i + 1, next_hit);
      const Eigen::Vector3d step = next_hit.t * there - hit.t * here;
      // Near a caustic the spreading is held to a limit, and a step may pass it.
      if (std::min(std::abs(at.upwards), std::abs(next.upwards)) < 0.1 ||
          at.upwards * next.upwards < 0.0 || step.norm() > 0.02 * hit.t)
        continue;
      const RayIncidence::Step a = at.in_sea(step, here), b = next.in_sea(step, there);
      const Eigen::Vector3d way = next.place - at.place, turn = next.direction - at.direction;
      worst_way =
          std::max(worst_way, (0.5 * (a.displacement + b.displacement) - way).norm() / way.norm());
      worst_turn = std::max(worst_turn, (0.5 * (a.turn + b.turn) - turn).norm() /
                                            (turn.norm() + step.norm() / hit.t));
      ++looked;
      crossed += at.upwards < 0.0;
    }
  };
  // Of its rays that start upwards, the steeper ones turn sooner and come down before the others.
  const scatter::SoundSpeedProfile folding({{0, 1558}, {7, 1523}, {20, 1510}});
  for (const scatter::SoundSpeedProfile* profile : {&thermocline, &duct, &folding})
    for (const double depth_m : {4.0, 10.0}) {
      RayFan fan = fan_at({0, 0, -depth_m}, 4000, 250.0);
      std::vector<Hit> hits(fan.grid->rays());
      embree->intersect(fan, hits);
      TravelTime straight(*profile, 1490.0);
      straight.apply(fan, hits);
      compare_neighbours(fan, straight, hits);
      fan.bend = bend_of(*profile, 15.0, fan.range_m, 1490.0);
      RefractedTracer tracer(*profile, -15.0, 15.0, 1490.0);
      tracer.trace(fan, {embree.get(), bed.mesh}, hits);
      compare_neighbours(fan, tracer, hits);
    }
  CAPTURE(looked);
  CHECK(worst_way < 1e-3);
  CHECK(worst_turn < 1e-3);
  CHECK(crossed > 100);
}
