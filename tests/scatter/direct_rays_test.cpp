#include <ensonify/scatter/direct_rays.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "scatter/absorbing_water.h"
#include "support/catch.h"

using namespace ensonify::scatter;
using ensonify::tests::absorbing;
using ensonify::tests::arc;

namespace {

const std::vector<SoundSpeedProfile>& direct_profiles() {
  static const std::vector<SoundSpeedProfile> all = {
      absorbing({{0, 1500}}),
      absorbing({{0, 1500}, {40, 1496}}),
      absorbing({{0, 1520}, {6, 1520}, {10, 1490}, {60, 1490.5}}),  // a strong thermocline
      absorbing({{1.81, 1481.35}, {3.35, 1476.16}, {5, 1475.21}, {9.76, 1478.1}, {30, 1482}}),
  };
  return all;
}

}  // namespace

TEST_CASE("A direct ray reaches the place and time of its arcs, and no other ray does") {
  for (const SoundSpeedProfile& profile : direct_profiles())
    for (const double source_m : {2.5, 6.0, 8.3}) {
      DirectRays rays(profile, 14.0, 22.0);
      rays.start_at(source_m);
      REQUIRE(rays.flattest() > 5.0);
      for (double cotangent = 0.0; cotangent < rays.flattest(); cotangent += 0.0371)
        for (const double depth_m : {14.0, 17.3, 22.0}) {
          const double hypotenuse = std::hypot(1.0, cotangent);
          const SoundRay ray = arc(profile, source_m, cotangent, depth_m);
          const SoundRayPoint& there = ray.point();
          DirectRays::Eigenray way{.cotangent = 0.3 * cotangent + 1.0};
          REQUIRE(rays.find(there.range_m, depth_m, way));
          CAPTURE(source_m, cotangent, depth_m);
          REQUIRE(way.cotangent == Approx(cotangent).margin(1e-6));
          REQUIRE(std::abs(way.time_s - there.time_s) < 1e-9);
          REQUIRE(way.path_m == Approx(there.path_m).margin(1e-3));
          REQUIRE(way.absorption_db == Approx(there.absorption_db).epsilon(3e-4));
          // q = dr/d(angle) sin, and d(cotangent) = -(1 + cotangent^2) d(angle)
          const double spread_m =
              way.range_per_cotangent_m * hypotenuse * hypotenuse * std::abs(there.down);
          REQUIRE(spread_m == Approx(std::abs(ray.spread_m())).epsilon(1e-4).margin(1e-6));
        }
    }
}

TEST_CASE("A point beyond the flattest ray is not reached") {
  DirectRays rays(direct_profiles()[1], 14.0, 22.0);
  rays.start_at(5.0);
  DirectRays::Eigenray way;
  CHECK(rays.find(60.0, 20.0, way));
  CHECK_FALSE(rays.find(2000.0, 20.0, way));
  CHECK(rays.find(0.999 * rays.farthest_m(20.0), 20.0, way));
  CHECK_FALSE(rays.find(1.001 * rays.farthest_m(20.0), 20.0, way));
  CHECK_THROWS_AS(DirectRays(direct_profiles()[0], 3.0, 2.0), std::invalid_argument);
}
