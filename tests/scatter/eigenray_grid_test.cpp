#include <ensonify/scatter/eigenray_grid.h>

#include <cmath>
#include <random>
#include <vector>

#include "scatter/absorbing_water.h"
#include "support/catch.h"

using namespace ensonify::scatter;
using ensonify::tests::absorbing;
using ensonify::tests::arc;

namespace {

const std::vector<SoundSpeedProfile>& grid_profiles() {
  static const std::vector<SoundSpeedProfile> all = {
      absorbing({{0, 1500}, {40, 1496}}),
      absorbing({{0, 1520}, {6, 1520}, {10, 1490}, {60, 1490.5}}),  // a strong thermocline
      absorbing({{0, 1490}, {6, 1490}, {10, 1520}, {60, 1521}}),    // upside down
      absorbing({{1.81, 1481.35}, {3.35, 1476.16}, {5, 1475.21}, {9.76, 1478.1}, {30, 1482}}),
  };
  return all;
}

}  // namespace

TEST_CASE("Between its exact rays a grid stays within a hundredth of a millimetre of the arcs") {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit;
  for (const SoundSpeedProfile& profile : grid_profiles())
    for (const double source_m : {2.5, 6.0, 8.3}) {
      EigenrayGrid lattice(profile, 9.0, 22.0);
      lattice.start_at(source_m);
      const double flattest = lattice.rays().flattest();
      REQUIRE(flattest > 4.0);
      for (int i = 0; i < 4000; ++i) {
        // (Near the flattest ray the exact rays have errors of a few hundredths themselves.)
        const double cotangent = 0.95 * flattest * std::pow(unit(random), 1.5);
        const double depth_m = 9.0 + 13.0 * unit(random);
        const SoundRayPoint there = arc(profile, source_m, cotangent, depth_m).point();
        DirectRays::Eigenray way;
        CAPTURE(source_m, cotangent, depth_m);
        REQUIRE(lattice.find(there.range_m, depth_m, way));
        REQUIRE(std::abs(way.cotangent - cotangent) * way.range_per_cotangent_m < 1e-5);
        REQUIRE(std::abs(way.time_s - there.time_s) * 1500.0 < 1e-5);
        REQUIRE(way.path_m == Approx(there.path_m).margin(1e-3));
        REQUIRE(way.absorption_db == Approx(there.absorption_db).epsilon(5e-4));
        REQUIRE(way.sound_speed_mps == Approx(there.sound_speed_mps).margin(1e-9));
        DirectRays::Eigenray exact{.cotangent = cotangent};
        REQUIRE(lattice.rays().find(there.range_m, depth_m, exact));
        REQUIRE(way.range_per_cotangent_m == Approx(exact.range_per_cotangent_m).epsilon(1e-3));
      }
      CAPTURE(lattice.cells());
      CHECK(lattice.rough_cells() < 0.45 * static_cast<double>(lattice.cells()));
    }
}

TEST_CASE("A grid gives exact rays where it has no cells, and none where no known ray comes") {
  EigenrayGrid lattice(grid_profiles()[0], 5.0, 22.0);
  lattice.start_at(4.99);
  DirectRays::Eigenray way, exact{.cotangent = 1.0};
  CHECK(lattice.find(0.02, 5.0, way));
  REQUIRE(lattice.rays().find(0.02, 5.0, exact));
  CHECK(way.time_s == Approx(exact.time_s).margin(1e-12));
  CHECK_FALSE(lattice.find(2000.0, 20.0, way));
  CHECK(lattice.find(0.0, 20.0, way));
  CHECK(way.cotangent == 0.0);
  const std::size_t cells = lattice.cells();
  lattice.start_at(4.99);
  CHECK(lattice.cells() == cells);
  lattice.start_at(3.0);
  CHECK(lattice.cells() == 0);
}
