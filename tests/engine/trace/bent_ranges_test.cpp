#include <ensonify/engine/trace/refraction/bent_ranges.h>

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "support/catch.h"

using namespace ensonify;
using namespace ensonify::engine;

namespace {

constexpr BentWay way{
    .source_depth_m = 6.0, .height_m = 6.0, .reference_mps = 1510.0, .range_m = 150.0};

/// Interpolated; none beyond the table or where rays meet no bed.
double range_at(const std::vector<LaunchRange>& ranges, double depression_rad) {
  for (std::size_t i = 1; i < ranges.size(); ++i)
    if (ranges[i].depression_rad <= depression_rad) {
      const LaunchRange &a = ranges[i - 1], &b = ranges[i];
      const double share =
          (a.depression_rad - depression_rad) / (a.depression_rad - b.depression_rad);
      return std::lerp(a.range_over_height, b.range_over_height, share);
    }
  return std::nan("");
}

}  // namespace

TEST_CASE(
    "in water of one speed a ray meets a level bed at 1 / sin(depression), one upwards never") {
  const scatter::SoundSpeedProfile even({{0.0, 1510.0}, {30.0, 1510.0}});
  const std::vector<LaunchRange> ranges = bent_ranges(even, way).by_launch;
  for (const double depression_rad : {1.5, 1.0, 0.3, 0.1, 0.05})
    CHECK(range_at(ranges, depression_rad) ==
          Approx(1.0 / std::sin(depression_rad)).epsilon(0.004));
  for (const double up_rad : {0.001, 0.02, 0.5}) CHECK(std::isnan(range_at(ranges, -up_rad)));
}

// On the way up to where it turns and back down to the source's depth a ray takes 2 / g atanh(sin).
TEST_CASE("a ray that turns meets the bed later than its mirror image by its arc above the sonar") {
  constexpr double per_s = 1.0, surface_mps = 1520.0;
  const scatter::SoundSpeedProfile falls({{0.0, surface_mps}, {30.0, surface_mps - 30.0 * per_s}});
  const std::vector<LaunchRange> ranges = bent_ranges(falls, way).by_launch;
  const double source_mps = surface_mps - per_s * way.source_depth_m;
  const double to_surface_rad = std::acos(source_mps / surface_mps);
  for (const double share : {0.01, 0.2, 0.5, 0.9, 0.99}) {
    const double up_rad = share * to_surface_rad;
    const double longer =
        way.reference_mps * 2.0 / per_s * std::atanh(std::sin(up_rad)) / way.height_m;
    CHECK(range_at(ranges, -up_rad) - range_at(ranges, up_rad) == Approx(longer).margin(0.05));
  }
  CHECK(std::isnan(range_at(ranges, -1.01 * to_surface_rad)));
}

TEST_CASE("neighbours differ by at most a 400th of the range, and the steepest comes first") {
  const scatter::SoundSpeedProfile duct(
      {{0.0, 1500.0}, {4.0, 1515.0}, {9.0, 1500.0}, {30.0, 1499.0}});
  const std::vector<LaunchRange> ranges = bent_ranges(duct, way).by_launch;
  const double range = way.range_m / way.height_m;
  for (std::size_t i = 1; i < ranges.size(); ++i) {
    const LaunchRange &a = ranges[i - 1], &b = ranges[i];
    REQUIRE(b.depression_rad <= a.depression_rad);
    if (a.range_over_height <= range && b.range_over_height <= range)  // or none
      REQUIRE(std::abs(b.range_over_height - a.range_over_height) <= range / 200.0);
  }
}

TEST_CASE("a ray launched level from the axis of a duct reaches no bed") {
  const scatter::SoundSpeedProfile duct(
      {{0.0, 1510.0}, {way.source_depth_m, 1500.0}, {30.0, 1502.0}});
  for (const LaunchRange& launch : bent_ranges(duct, way).by_launch)
    if (std::abs(launch.depression_rad) < 1e-9) CHECK(std::isinf(launch.range_over_height));
}

TEST_CASE("a cast with a row each millimetre and its noise lays rays as the cast without noise") {
  std::mt19937 random(1);
  std::normal_distribution<double> noise_mps(0.0, 0.05);
  std::vector<scatter::SoundSpeedSample> dense;
  for (double depth_m = 0.0; depth_m < 30.0; depth_m += 1.01e-3)
    dense.push_back({depth_m, 1510.0 - depth_m + noise_mps(random)});
  const std::vector<LaunchRange> of_dense =
      bent_ranges(scatter::SoundSpeedProfile(dense), way).by_launch;
  const std::vector<LaunchRange> smooth =
      bent_ranges(scatter::SoundSpeedProfile({{0.0, 1510.0}, {30.0, 1480.0}}), way).by_launch;
  CHECK(of_dense.size() < 10'000);
  for (const double depression_rad : {1.5, 1.0, 0.5, 0.2, 0.1, 0.05})
    CHECK(range_at(of_dense, depression_rad) ==
          Approx(range_at(smooth, depression_rad)).epsilon(0.003));
}
