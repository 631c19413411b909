#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "support/catch.h"

#include <ensonify/scatter/sound_speed_profile.h>

using namespace ensonify::scatter;

namespace {

const std::vector<SoundSpeedSample> shallow_duct_samples = {{1.81, 1481.35}, {3.35, 1476.16},
                                                            {5.0, 1475.21},  {6.1, 1475.21},
                                                            {9.76, 1478.1},  {100.0, 1482.31}};

/// 1 / mean of 1 / c by the midpoint rule: an independent computation.
double summed_mean_mps(const SoundSpeedProfile& profile, double from_m, double to_m) {
  constexpr int steps = 200000;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i)
    sum += 1.0 / profile.speed_mps(from_m + (to_m - from_m) * (i + 0.5) / steps);
  return steps / sum;
}

}  // namespace

TEST_CASE("A profile has its samples' speeds, and is linear between them") {
  const SoundSpeedProfile profile(shallow_duct_samples);
  for (const auto& [depth_m, mps, absorption] : shallow_duct_samples)
    CHECK(profile.speed_mps(depth_m) == mps);
  CHECK(profile.speed_mps(2.58) == Approx(0.5 * (1481.35 + 1476.16)));
  CHECK(profile.speed_mps(5.7) == 1475.21);
  CHECK(profile.speed_mps(9.76 + 0.25 * (100.0 - 9.76)) ==
        Approx(1478.1 + 0.25 * (1482.31 - 1478.1)));
}

TEST_CASE("Above the first and below the last sample the speed stays constant") {
  const SoundSpeedProfile profile(shallow_duct_samples);
  CHECK(profile.speed_mps(0.0) == 1481.35);
  CHECK(profile.speed_mps(-5.0) == 1481.35);
  CHECK(profile.speed_mps(11000.0) == 1482.31);
  CHECK(profile.shallowest_m() == 1.81);
  CHECK(profile.deepest_m() == 100.0);
}

TEST_CASE("The mean absorption between two depths is that of its samples, linear between them") {
  const SoundSpeedProfile profile =
      SoundSpeedProfile(shallow_duct_samples).with_absorption([](double depth_m, double mps) {
        return 1e-3 * (mps - 1400.0) + 2e-4 * depth_m;
      });
  for (const auto& [from_m, to_m] :
       {std::pair{-3.0, 1.0}, {-3.0, 150.0}, {2.0, 5.5}, {40.0, 3.0}, {120.0, 130.0}, {5.2, 5.2}}) {
    double sum = 0.0;
    constexpr int steps = 100000;
    for (int i = 0; i < steps; ++i) {
      const double z = std::clamp(from_m + (to_m - from_m) * (i + 0.5) / steps, 1.81, 100.0);
      sum += 1e-3 * (profile.speed_mps(z) - 1400.0) + 2e-4 * z;
    }
    CAPTURE(from_m, to_m);
    CHECK(profile.mean_absorption_db_per_m(from_m, to_m) == Approx(sum / steps).epsilon(1e-6));
  }
  CHECK(profile.speed_mps(7.0) == SoundSpeedProfile(shallow_duct_samples).speed_mps(7.0));
  CHECK(SoundSpeedProfile(shallow_duct_samples).mean_absorption_db_per_m(0.0, 50.0) == 0.0);
}

TEST_CASE("Absorption follows from the speed at each depth, however few samples say it") {
  // It bends in a layer as that of Francois and Garrison does from 20 to 4 degrees.
  const auto absorption = [](double depth_m, double mps) {
    return 0.1 * std::exp(0.008 * (mps - 1500.0)) + 1e-6 * depth_m;
  };
  const SoundSpeedProfile few =
      SoundSpeedProfile({{0.0, 1521.0}, {12.0, 1521.0}, {16.0, 1465.0}, {40.0, 1466.0}})
          .with_absorption(absorption);
  double sum = 0.0;
  constexpr int steps = 100000;
  for (int i = 0; i < steps; ++i) {
    const double z = 10.0 + 8.0 * (i + 0.5) / steps;
    sum += absorption(z, few.speed_mps(z));
  }
  CHECK(few.mean_absorption_db_per_m(10.0, 18.0) == Approx(sum / steps).epsilon(1e-3));
  for (const double z : {12.5, 13.0, 14.0, 15.1})
    CHECK(few.mean_absorption_db_per_m(z, z) ==
          Approx(absorption(z, few.speed_mps(z))).epsilon(1.1e-3));
  CHECK(few.layers().size() < 20);
}

TEST_CASE("A single sample is the same water everywhere") {
  const SoundSpeedProfile profile({{20.0, 1500.0}});
  REQUIRE(profile.layers().size() == 2);
  for (const double depth_m : {0.0, 20.0, 5000.0}) CHECK(profile.speed_mps(depth_m) == 1500.0);
  CHECK(profile.mean_speed_mps(0.0, 5000.0) == Approx(1500.0).epsilon(1e-15));
  CHECK(profile.shallowest_m() == profile.deepest_m());
}

TEST_CASE("Layers join without a gap or a jump, and each depth lies in the layer of its index") {
  const SoundSpeedProfile profile(shallow_duct_samples);
  const auto& layers = profile.layers();
  REQUIRE(layers.size() == shallow_duct_samples.size() + 1);
  CHECK(layers.front().top_m == -std::numeric_limits<double>::infinity());
  CHECK(layers.back().bottom_m == std::numeric_limits<double>::infinity());
  CHECK(layers.front().gradient_per_s == 0.0);
  CHECK(layers.back().gradient_per_s == 0.0);
  for (std::size_t i = 1; i < layers.size(); ++i) {
    CHECK(layers[i].top_m == layers[i - 1].bottom_m);
    CHECK(layers[i].top_mps == layers[i - 1].bottom_mps);
    CHECK(layers[i].bottom_m > layers[i].top_m);
    if (i + 1 < layers.size())
      CHECK(layers[i].top_mps + layers[i].gradient_per_s * (layers[i].bottom_m - layers[i].top_m) ==
            Approx(layers[i].bottom_mps).epsilon(1e-14));
    CHECK(profile.layer_index(layers[i].top_m) == i);
    CHECK(profile.layer_index(std::nextafter(layers[i].top_m, -1.0)) == i - 1);
  }
  for (double depth_m = -1.0; depth_m < 120.0; depth_m += 0.37) {
    const SoundSpeedLayer& layer = layers[profile.layer_index(depth_m)];
    CHECK(depth_m >= layer.top_m);
    CHECK(depth_m < layer.bottom_m);
  }
}

TEST_CASE("The speed is continuous across every sample") {
  const SoundSpeedProfile profile(shallow_duct_samples);
  for (const auto& [depth_m, mps, absorption] : shallow_duct_samples)
    for (const double step_m : {-1e-9, 1e-9})
      CHECK(std::abs(profile.speed_mps(depth_m + step_m) - mps) < 1e-8);
}

TEST_CASE("The order of the samples does not matter, to the last bit") {
  std::vector<SoundSpeedSample> samples = shallow_duct_samples;
  samples.push_back({5.0, 1475.3});  // one depth three times
  samples.push_back({5.0, 1475.1});
  const SoundSpeedProfile sorted(samples);
  std::mt19937 random(1);
  for (int i = 0; i < 50; ++i) {
    std::ranges::shuffle(samples, random);
    const SoundSpeedProfile profile(samples);
    REQUIRE(profile.layers().size() == sorted.layers().size());
    for (double depth_m = 0.0; depth_m < 110.0; depth_m += 0.5)
      REQUIRE(profile.speed_mps(depth_m) == sorted.speed_mps(depth_m));
  }
}

TEST_CASE("Samples at one depth, or within a millimetre, become one with their mean speed") {
  const SoundSpeedProfile profile(
      {{0.0, 1500.0}, {10.0, 1510.0}, {10.0, 1512.0}, {10.0005, 1514.0}, {20.0, 1520.0}});
  REQUIRE(profile.layers().size() == 4);
  CHECK(profile.speed_mps(10.0) == 1512.0);
  CHECK(profile.speed_mps(15.0) == Approx(1516.0));
  // A chain of near samples does not become one.
  std::vector<SoundSpeedSample> chain;
  for (int i = 0; i <= 100; ++i) chain.push_back({i * 0.0006, 1500.0 + i});
  const SoundSpeedProfile fine(chain);
  CHECK(fine.layers().size() == 52);
  CHECK(fine.speed_mps(0.0) == 1500.5);
}

TEST_CASE("The mean speed is distance over the time straight down") {
  const SoundSpeedProfile profile(shallow_duct_samples);
  for (const auto& [from_m, to_m] : {std::pair{0.0, 150.0},
                                     {2.0, 3.0},
                                     {3.35, 9.76},
                                     {5.1, 6.0},
                                     {0.0, 1.0},
                                     {120.0, 130.0},
                                     {1.0, 2.0}}) {
    CAPTURE(from_m, to_m);
    CHECK(profile.mean_speed_mps(from_m, to_m) ==
          Approx(summed_mean_mps(profile, from_m, to_m)).epsilon(1e-9));
    CHECK(profile.mean_speed_mps(from_m, to_m) == profile.mean_speed_mps(to_m, from_m));
  }
  CHECK(profile.mean_speed_mps(2.58, 2.58) == profile.speed_mps(2.58));
  CHECK(profile.mean_speed_mps(2.58, 2.58 + 1e-9) == Approx(profile.speed_mps(2.58)));
}

TEST_CASE("The times of two parts add up to the time of the whole") {
  const SoundSpeedProfile profile(shallow_duct_samples);
  const auto time_s = [&](double a, double b) { return (b - a) / profile.mean_speed_mps(a, b); };
  for (double middle_m = 0.5; middle_m < 140.0; middle_m += 1.7)
    CHECK(time_s(0.0, middle_m) + time_s(middle_m, 140.0) ==
          Approx(time_s(0.0, 140.0)).epsilon(1e-13));
}

TEST_CASE("A gradient near zero gives the same as none") {
  for (const double change : {1e-3, 1e-6, 1e-9, 2.3e-13, 0.0}) {
    const SoundSpeedProfile profile({{0.0, 1500.0}, {100.0, 1500.0 + change}});
    CHECK(profile.mean_speed_mps(0.0, 100.0) == Approx(1500.0 + change / 2).epsilon(1e-13));
  }
}

TEST_CASE("Samples that no sea has are refused") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double inf = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(SoundSpeedProfile({}), std::invalid_argument);
  for (const double depth_m : {-0.1, 12000.1, nan, inf, -inf})
    CHECK_THROWS_AS(SoundSpeedProfile({{depth_m, 1500.0}}), std::invalid_argument);
  for (const double mps : {999.9, 2000.1, nan, inf, -1500.0, 0.0})
    CHECK_THROWS_AS(SoundSpeedProfile({{0.0, 1500.0}, {1.0, mps}}), std::invalid_argument);
  CHECK_NOTHROW(SoundSpeedProfile({{0.0, 1000.0}, {12000.0, 2000.0}}));
  const SoundSpeedProfile profile({{0.0, 1500.0}});
  CHECK_THROWS_AS(profile.mean_speed_mps(nan, 1.0), std::invalid_argument);
  CHECK_THROWS_AS(profile.mean_speed_mps(0.0, inf), std::invalid_argument);
}

TEST_CASE("A profile reports what its cast lacks, and whether it had to be sorted") {
  const SoundSpeedProfile profile(shallow_duct_samples);
  CHECK(profile.remarks(1.81, 100.0).empty());
  REQUIRE(profile.remarks(1.0, 100.0).size() == 1);
  CHECK(profile.remarks(1.0, 100.0)[0].find("starts at 1.8 m") != std::string::npos);
  REQUIRE(profile.remarks(2.0, 120.0).size() == 1);
  CHECK(profile.remarks(2.0, 120.0)[0].find("ends at 100.0 m") != std::string::npos);
  REQUIRE(SoundSpeedProfile({{20.0, 1500.0}}).remarks(0.0, 30.0).size() == 1);
  CHECK(SoundSpeedProfile({{20.0, 1500.0}}).remarks(0.0, 30.0)[0].find("one sample") !=
        std::string::npos);
  std::vector<SoundSpeedSample> upcast(shallow_duct_samples.rbegin(), shallow_duct_samples.rend());
  CHECK(SoundSpeedProfile(upcast).remarks(2.0, 90.0).empty());  // recorded upwards
  std::swap(upcast[1], upcast[2]);
  REQUIRE(SoundSpeedProfile(upcast).remarks(2.0, 90.0).size() == 1);
  CHECK(SoundSpeedProfile(upcast).remarks(2.0, 90.0)[0].find("sorted") != std::string::npos);
  const SoundSpeedProfile repeated({{0.0, 1500.0}, {10.0, 1501.0}, {10.0, 1499.5}, {20.0, 1500.0}});
  CHECK(repeated.remarks(0.0, 20.0).empty());
  const SoundSpeedProfile damaged({{0.0, 1500.0}, {10.0, 1600.0}, {10.0, 1400.0}, {20.0, 1500.0}});
  REQUIRE(damaged.remarks(0.0, 20.0).size() == 1);
  CHECK(damaged.remarks(0.0, 20.0)[0].find("at 10.0 m differ by 200.0 m/s") != std::string::npos);
}
