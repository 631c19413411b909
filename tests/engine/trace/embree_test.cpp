#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <sys/mman.h>
#include <unistd.h>

#include "support/catch.h"
#include "support/hits.h"
#include "support/little_memory.h"

#include <ensonify/engine/trace/embree/embree.h>
#include <ensonify/refine/parallel_for.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;
using Eigen::Vector3f;
using ensonify::tests::hits_of;

namespace {

/// A rippled square of cells x cells around the origin, heights near 0, cells half a metre wide.
refine::TriangleMesh ripples(std::uint32_t cells) {
  refine::TriangleMesh mesh;
  const float half = 0.25f * static_cast<float>(cells);
  std::minstd_rand random(1);
  std::uniform_real_distribution<float> rough(-0.02f, 0.02f);
  for (std::uint32_t j = 0; j <= cells; ++j)
    for (std::uint32_t i = 0; i <= cells; ++i) {
      const float x = 0.5f * static_cast<float>(i) - half, y = 0.5f * static_cast<float>(j) - half;
      mesh.positions.emplace_back(x, y, 0.1f * std::sin(2.0f * x) + rough(random));
    }
  for (std::uint32_t j = 0; j < cells; ++j)
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t a = j * (cells + 1) + i, b = a + cells + 1;
      mesh.faces.push_back({a, a + 1, b + 1});
      mesh.faces.push_back({a, b + 1, b});
    }
  return mesh;
}

/// A fan from 5 m above the middle, towards positive y.
RayFan fan_over(int elevations) {
  auto grid = std::make_shared<FanGrid>(FanLayout{.sector_low_rad = 0.05,
                                                  .sector_high_rad = 1.5,
                                                  .truncation_rad = 0.3,
                                                  .main_lobe_rad = 0.1,
                                                  .planes = 8,
                                                  .elevations = std::max(elevations, 2)});
  for (auto* table : {&grid->elevation_rad, &grid->sin_elevation, &grid->cos_elevation})
    table->resize(static_cast<std::size_t>(elevations));
  const double down = grid->middle_depression_rad;
  return {.grid = grid,
          .origin = {0.1, 0.2, 5.0},
          .array_axis = {1, 0, 0},
          .middle = {0, std::cos(down), -std::sin(down)},
          .pole = {0, std::sin(down), std::cos(down)},
          .range_m = 40.0};
}

std::vector<Ray> rays_of(const RayFan& fan) {
  std::vector<Ray> rays;
  for (std::size_t plane = 0; plane < fan.planes(); ++plane)
    for (std::size_t elevation = 0; elevation < fan.elevations(); ++elevation)
      if (fan.grid->within_beam(plane, elevation)) rays.push_back(fan.ray(plane, elevation));
  return rays;
}

/// Rays aimed at vertices and at the middles of edges, where faces tie and rays leak.
std::vector<Ray> rays_at_ties(const refine::TriangleMesh& mesh) {
  std::vector<Ray> rays;
  const Vector3d origin(0.1, 0.2, 5.0);
  const auto aim = [&](const Vector3f& at) {
    rays.push_back({origin, (at.cast<double>() - origin).normalized()});
  };
  for (const refine::Face& face : mesh.faces) {
    if (!(mesh.positions[face[0]].head<2>().norm() < 20.0f)) continue;
    aim(mesh.positions[face[0]]);
    aim(0.5f * (mesh.positions[face[0]] + mesh.positions[face[2]]));
  }
  return rays;
}

std::vector<Hit> hits_of(const Intersector& tracer, const std::vector<Ray>& rays) {
  std::vector<Hit> hits(rays.size());
  tracer.intersect(rays, hits);
  return hits;
}
Hit shoot(const Intersector& tracer, const Ray& ray) {
  return hits_of(tracer, std::vector{ray})[0];
}

std::size_t count(const std::vector<Hit>& hits) {
  return static_cast<std::size_t>(std::ranges::count_if(hits, [](const Hit& h) { return !!h; }));
}

/// How many differ by at least one bit.
std::size_t differences(const std::vector<Hit>& a, const std::vector<Hit>& b) {
  const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  REQUIRE(a.size() == b.size());
  std::size_t n = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    n += a[i].face != b[i].face || bits(a[i].t) != bits(b[i].t) || bits(a[i].u) != bits(b[i].u) ||
         bits(a[i].v) != bits(b[i].v);
  return n;
}

/// The largest relative difference in distance; infinity if only one of two rays hits.
double largest_difference(const std::vector<Hit>& a, const std::vector<Hit>& b) {
  REQUIRE(a.size() == b.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (a[i] || b[i])
      largest = std::max(largest, a[i] && b[i] ? std::abs(a[i].t - b[i].t) / b[i].t
                                               : std::numeric_limits<double>::infinity());
  return largest;
}

template <class F>
void on_every_instruction_set(F&& check) {
  for (const std::string_view set : instruction_sets()) {
    CAPTURE(std::string(set));
    check(IntersectorOptions{.instruction_set = std::string(set)});
  }
}

}  // namespace

TEST_CASE("a rebuilt tree answers like a new one") {
  const refine::TriangleMesh one = ripples(60), other = ripples(41), none;
  const RayFan fan = fan_over(300);
  for (const bool for_one_ping : {false, true}) {
    const IntersectorOptions options{.for_one_ping = for_one_ping};
    const auto fresh_one = make_intersector("embree", one, options);
    const auto fresh_other = make_intersector("embree", other, options);
    REQUIRE(differences(hits_of(*fresh_one, fan), hits_of(*fresh_other, fan)) > 100);

    const auto again = make_embree(options);
    CHECK(count(hits_of(*again, fan)) == 0);  // empty until it is built
    for (int round = 0; round < 2; ++round) {
      again->build(one);
      CHECK(differences(hits_of(*again, fan), hits_of(*fresh_one, fan)) == 0);
      again->build(none);
      CHECK(count(hits_of(*again, fan)) == 0);
      again->build(other);
      CHECK(differences(hits_of(*again, fan), hits_of(*fresh_other, fan)) == 0);
    }
  }
}

TEST_CASE("trees for one ping and for many give the same hits to the bit, ties included") {
  const refine::TriangleMesh mesh = ripples(100);
  const RayFan fan = fan_over(1000);
  const std::vector<Ray> ties = rays_at_ties(mesh);
  on_every_instruction_set([&](IntersectorOptions options) {
    const auto many = make_intersector("embree", mesh, options);
    options.for_one_ping = true;
    const auto one = make_intersector("embree", mesh, options);
    CHECK(count(hits_of(*many, fan)) > 5000);
    CHECK(differences(hits_of(*many, fan), hits_of(*one, fan)) == 0);
    CHECK(differences(hits_of(*many, ties), hits_of(*one, ties)) == 0);
  });
}

TEST_CASE("packets and single rays give the same hits: to the bit, with AVX2 to a rounding") {
  const refine::TriangleMesh mesh = ripples(100);
  on_every_instruction_set([&](const IntersectorOptions& options) {
    // With AVX2 some processors round the distances of packets and of single rays differently.
    const auto same = [&](const std::vector<Hit>& one, const std::vector<Hit>& other) {
      return options.instruction_set == "avx2" ? largest_difference(one, other) < 0x1p-20
                                               : differences(one, other) == 0;
    };
    const auto packets = make_intersector("embree", mesh, options);
    const auto singles = make_intersector("embree-single", mesh, options);
    for (const int elevations : {1, 2, 15, 16, 17, 1000}) {
      CAPTURE(elevations);
      const RayFan fan = fan_over(elevations);
      const std::vector<Hit> together = hits_of(*packets, fan), alone = hits_of(*singles, fan);
      CHECK(same(together, alone));
      std::vector<Hit> within;  // as a list of rays
      for (std::size_t ray = 0; ray < together.size(); ++ray)
        if (fan.grid->within_beam(ray / fan.elevations(), ray % fan.elevations()))
          within.push_back(together[ray]);
        else
          CHECK(!together[ray]);
      CHECK(same(within, hits_of(*packets, rays_of(fan))));
    }
  });
}

TEST_CASE("all rays of a packet hit the bed, even if one hardly leaves a plane of the tree") {
  const refine::TriangleMesh mesh = ripples(100);
  RayFan fan = fan_over(16);
  auto grid = std::make_shared<FanGrid>(*fan.grid);
  for (std::size_t i = 0; i < 16; ++i) {
    const double across = i < 15 ? -0.7 + 0.0467 * static_cast<double>(i) : -1.8e-19;
    grid->elevation_rad[i] = grid->sin_elevation[i] = across;
    grid->cos_elevation[i] = std::sqrt(1.0 - across * across);
  }
  for (FanGrid::Plane& plane : grid->planes) plane.sin_azimuth = 0.0, plane.cos_azimuth = 1.0;
  const double s = std::sqrt(0.5);
  fan = {.grid = grid,
         .origin = {0.0, 0.2, 0.5},  // where vertices are
         .array_axis = {0, -s, s},
         .middle = {0, -s, -s},
         .pole = {1, 0, 0},
         .range_m = 40.0};
  const std::vector<Hit> expected = hits_of(*make_intersector("pluecker", mesh), fan);
  on_every_instruction_set([&](const IntersectorOptions& options) {
    const std::vector<Hit> found = hits_of(*make_intersector("embree", mesh, options), fan);
    for (std::size_t i = 0; i < found.size(); ++i) CHECK(found[i].t == Approx(expected[i].t));
  });
}

TEST_CASE("of coincident faces the lowest is hit, at any place in the tree") {
  refine::TriangleMesh mesh = ripples(60);
  const std::size_t once = mesh.faces.size();
  for (int copies = 0; copies < 3; ++copies)
    for (std::size_t i = 0; i < once; ++i) mesh.faces.emplace_back(mesh.faces[i]);
  std::shuffle(mesh.faces.begin(), mesh.faces.end(), std::minstd_rand(2));
  std::map<refine::Face, std::uint32_t> lowest;
  for (std::uint32_t i = 0; i < mesh.faces.size(); ++i) lowest.emplace(mesh.faces[i], i);

  const RayFan fan = fan_over(500);
  on_every_instruction_set([&](IntersectorOptions options) {
    for (const bool for_one_ping : {false, true})
      for (const char* name : {"embree", "embree-single"}) {
        options.for_one_ping = for_one_ping;
        const auto tracer = make_intersector(name, mesh, options);
        for (const std::vector<Hit>& hits :
             {hits_of(*tracer, fan), hits_of(*tracer, rays_of(fan))}) {
          std::size_t wrong = 0;
          for (const Hit& hit : hits) wrong += hit && hit.face != lowest[mesh.faces[hit.face]];
          CHECK(count(hits) > 2000);
          CHECK(wrong == 0);
        }
      }
  });
}

TEST_CASE("robust trees stop rays at vertices and edges that fast ones let through") {
  const refine::TriangleMesh mesh = ripples(100);
  const std::vector<Ray> rays = rays_at_ties(mesh);
  const auto lost = [&](bool robust) {
    const auto tracer = make_intersector("embree", mesh, {.robust = robust});
    CHECK(tracer->code_path().ends_with(" fast") == !robust);
    return 1.0 -
           static_cast<double>(count(hits_of(*tracer, rays))) / static_cast<double>(rays.size());
  };
  CHECK(lost(true) < 0.01);
  CHECK(lost(false) > 0.05);
}

TEST_CASE("the triangles' memory is shared, not changed, and not read beyond its end") {
  // Two pages, of which the second must not be touched; the positions end where the first does.
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  char* memory = static_cast<char*>(
      mmap(nullptr, 2 * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
  REQUIRE(memory != MAP_FAILED);
  REQUIRE(mprotect(memory + page, page, PROT_NONE) == 0);
  const refine::TriangleMesh mesh = ripples(10);
  const std::size_t bytes = mesh.positions.size() * sizeof(Vector3f);
  REQUIRE(bytes < page);
  const RayFan fan = fan_over(100);
  for (const bool for_one_ping : {false, true})
    for (const std::size_t from_end : {0u, 4u, 8u, 12u}) {
      char* at = memory + page - bytes - from_end;
      std::memcpy(at, mesh.positions.front().data(), bytes);
      const std::vector<refine::Face> faces = mesh.faces;
      const refine::Triangles triangles{
          {reinterpret_cast<const Vector3f*>(at), mesh.positions.size()}, faces};
      const IntersectorOptions options{.for_one_ping = for_one_ping};
      const auto tracer = make_intersector("embree", triangles, options);
      const auto expected = make_intersector("embree", mesh, options);
      CHECK(count(hits_of(*tracer, fan)) > 50);
      CHECK(differences(hits_of(*tracer, fan), hits_of(*expected, fan)) == 0);
      CHECK(std::memcmp(at, mesh.positions.data(), bytes) == 0);
      CHECK(faces == mesh.faces);
    }
  munmap(memory, 2 * page);
}

TEST_CASE(
    "an instruction set is chosen by name, and a missing one refused with the existing ones") {
  const refine::TriangleMesh mesh = ripples(40);
  const std::vector<std::string_view> there = instruction_sets();
  REQUIRE(!there.empty());
  on_every_instruction_set([&](const IntersectorOptions& options) {
    CHECK(make_intersector("embree", mesh, options)->code_path() == options.instruction_set);
  });
  const std::string by_default(make_embree({})->code_path());
  CHECK(std::ranges::count(there, by_default) == 1);
  CHECK(by_default != "avx512");
  for (const char* unknown : {"avx3", "AVX2", " ", "avx2,threads=1", "isa"})
    CHECK_THROWS_WITH(make_embree({.instruction_set = unknown}),
                      Catch::Contains(unknown) && Catch::Contains(std::string(there.front())));
  CHECK_THROWS_AS(make_embree({.instruction_set = "avx3"}), std::invalid_argument);
}

#if defined(__x86_64__)
TEST_CASE("the chosen instruction set is the one that runs: the last bits differ") {
  const std::vector<std::string_view> there = instruction_sets();
  if (std::ranges::count(there, "avx2") == 0) return;
  const refine::TriangleMesh mesh = ripples(100);
  const RayFan fan = fan_over(1000);
  const auto on = [&](const char* set) {
    return hits_of(*make_intersector("embree", mesh, {.instruction_set = set}), fan);
  };
  CHECK(differences(on("sse4.2"), on("avx2")) > 100);
  CHECK(differences(on("avx2"), on("avx2")) == 0);
}
#endif

TEST_CASE("directions of any length are answered, if the distance is a finite double") {
  const refine::TriangleMesh mesh{.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                                  .faces = {{0, 1, 2}}};
  const auto tracer = make_intersector("embree", mesh);
  const Vector3d origin(0.25, 0.5, 2.0);
  for (const double length : {1.0, 3.0, 1e-3, 1e-30, 1e-40, 1e-300, 1e10, 1e18}) {
    CAPTURE(length);
    const Hit hit = shoot(*tracer, {origin, {0, 0, -length}});
    REQUIRE(hit);
    CHECK(hit.t == Approx(2.0 / length));
    CHECK(hit.u == Approx(0.25));
    CHECK(!shoot(*tracer, {origin, {0, 0, -length}, 0.0, 1.9 / length}));
    CHECK(shoot(*tracer, {origin, {0, 0, -length}, 0.0, 2.1 / length}));
    CHECK(!shoot(*tracer, {origin, {0, 0, -length}, std::min(2.1 / length, 1e18)}) ==
          (length > 1e-17));
    // A sideways component too small for float next to the other, and negligible for the hit.
    CHECK(shoot(*tracer, {origin, {1e-60 * length, 0, -length}}).t == Approx(2.0 / length));
  }
  // Straight down with length 5e-324: t would overflow for 2 m.
  CHECK(!shoot(*tracer, {origin, {0, 0, -5e-324}}));
  CHECK(!shoot(*tracer, {origin, {0, 0, -1}, 1e18}));
  for (const double length : {1.0, 3.0, 0.7, 1e-9})  // a ray that begins or ends on the face
    for (const auto& [from, to] : {std::pair{2.0, 2.0}, {0.0, 2.0}, {2.0, 9.0}})
      CHECK(shoot(*tracer, {origin, {0, 0, -length}, from / length, to / length}).t ==
            Approx(2.0 / length).epsilon(1e-6));
  CHECK(!std::signbit(shoot(*tracer, {{0.25, 0.5, 0.0}, {0, 0, -1}}).t));
  const Hit far = shoot(*tracer, {{0.25, 0.5, 1e18}, {0, 0, -1}});
  CHECK((!far || std::isfinite(far.t + far.u + far.v)));
}

TEST_CASE("distances and weights are always finite, for faces of any size") {
  const auto e = 1e9f;
  const refine::TriangleMesh mesh{.positions = {{-e, -e, 0}, {e, -e, 0}, {0, e, 0}},
                                  .faces = {{0, 1, 2}}};
  const auto tracer = make_intersector("embree", mesh);
  for (const double height : {1e-30, 1.0, 1e9, 1e15, 1e18}) {
    const Hit hit = shoot(*tracer, {{0, 0, height}, {0, 0, -1}});
    if (hit) CHECK(std::isfinite(hit.t + hit.u + hit.v));
    if (height <= 1e9) CHECK(hit.t == Approx(height));
  }
  for (const float beyond : {1.1e9f, 1e18f, 1e38f}) {
    refine::TriangleMesh larger = mesh;
    larger.positions[1].x() = beyond;
    CHECK_THROWS_AS(make_intersector("embree", larger), refine::MeshError);
  }
  refine::TriangleMesh torn = mesh;
  torn.faces.push_back({0, 1, 3});
  CHECK_THROWS_WITH(make_intersector("embree", torn), Catch::Contains("face 1"));
}

TEST_CASE("a tree for one ping leaves the other threads alone") {
  if (std::thread::hardware_concurrency() < 2) return;
  const refine::TriangleMesh mesh = ripples(60);
  const auto tracer = make_intersector("embree", mesh, {.for_one_ping = true});
  // Two items that wait for each other: only two threads can finish in time.
  std::atomic<int> arrived = 0;
  std::atomic<bool> both = true;
  refine::parallel_for(2, 2, [&](std::size_t, int) {
    ++arrived;
    const auto late = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (arrived < 2 && std::chrono::steady_clock::now() < late) std::this_thread::yield();
    if (arrived < 2) both = false;
  });
  CHECK(both);
}

#ifdef ENSONIFY_CAN_LIMIT_MEMORY
TEST_CASE("out of memory is an error, after which a tree can be built again") {
  const refine::TriangleMesh mesh = ripples(500), small = ripples(60);
  const RayFan fan = fan_over(300);
  for (const bool for_one_ping : {false, true}) {
    const IntersectorOptions options{.for_one_ping = for_one_ping};
    const std::vector<Hit> expected = hits_of(*make_intersector("embree", small, options), fan);
    const auto tracer = make_embree(options);
    tracer->build(small);
    std::size_t refused = 0, built = 0;
    for (std::size_t kib = 0; kib < 200 * 1024 && built == 0; kib += kib / 4 + 512) {
      bool failed = false;
      {
        const tests::LittleMemory little(1024 * kib);
        try {
          tracer->build(mesh);
        } catch (const std::exception&) {
          failed = true;
        }
      }
      refused += failed;
      built += !failed;
      if (failed) CHECK(count(hits_of(*tracer, fan)) == 0);
      tracer->build(small);
      CHECK(differences(hits_of(*tracer, fan), expected) == 0);
    }
    CHECK(refused > 3);
    CHECK(built == 1);
  }
}
#endif
