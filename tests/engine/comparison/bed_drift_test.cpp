// How far the bed moves from ping to ping, on lines whose texture moves by a known way.

#include <cmath>
#include <random>

#include "support/catch.h"

#include <ensonify/engine/comparison/bed_drift.h>
#include <ensonify/engine/comparison/find_bed.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

constexpr std::size_t drift_pings = 100, drift_samples = 800, water_samples = 60;
constexpr double drift_sample_m = 0.05;

/// The amplitudes of one side: a texture that moves by `drift_m` per ping, with independent
/// speckle in each ping.
std::vector<float> drifting(double drift_m, unsigned seed) {
  std::mt19937 random(seed);
  std::exponential_distribution<double> power;
  std::vector<double> texture(3 * drift_samples);
  for (double& value : texture) value = power(random);
  std::vector<float> side;
  for (std::size_t ping = 0; ping < drift_pings; ++ping)
    for (std::size_t k = 0; k < drift_samples; ++k) {
      const double at = static_cast<double>(drift_samples + k) -
                        drift_m / drift_sample_m * static_cast<double>(ping);
      const auto whole = static_cast<std::size_t>(at);
      const double ground = std::lerp(texture[whole], texture[whole + 1], at - std::floor(at));
      const double level = k < water_samples ? 1e-3 : ground;
      side.push_back(static_cast<float>(1000.0 * std::sqrt(level * power(random))));
    }
  return side;
}

RecordedLine line_of(double port_m, double starboard_m) {
  RecordedLine line{.samples = drift_samples};
  for (std::size_t ping = 0; ping < drift_pings; ++ping)
    line.pings.push_back(
        {.number = ping, .range_m = drift_samples * drift_sample_m, .samples = drift_samples});
  line.port = drifting(port_m, 1);
  line.starboard = drifting(starboard_m, 2);
  return line;
}

std::optional<double> drift_m(const RecordedLine& line, Side side) {
  return bed_drift_m(line, side, find_bed(line, side).first_sample, 0, line.pings.size());
}

}  // namespace

TEST_CASE("the bed's drift per ping is that of its texture, to a tenth of a sample") {
  for (const double moved_m : {0.0, 0.05, -0.05, 0.12, -0.33, 0.018}) {
    CAPTURE(moved_m);
    const RecordedLine line = line_of(moved_m, -moved_m);
    const std::optional<double> port_m = drift_m(line, Side::port),
                                starboard_m = drift_m(line, Side::starboard);
    REQUIRE(port_m);
    REQUIRE(starboard_m);
    CHECK(*port_m == Approx(moved_m).margin(0.1 * drift_sample_m));
    CHECK(*starboard_m == Approx(-moved_m).margin(0.1 * drift_sample_m));
    CHECK(*sideways_drift_m(port_m, starboard_m) == Approx(-moved_m).margin(0.1 * drift_sample_m));
  }
}

TEST_CASE("a change of altitude moves both sides alike, which is no sideways drift") {
  const RecordedLine line = line_of(-0.1, -0.1);
  CHECK(*sideways_drift_m(drift_m(line, Side::port), drift_m(line, Side::starboard)) ==
        Approx(0.0).margin(0.1 * drift_sample_m));
}

TEST_CASE("the likeness of pings lasts as long as their bed stays the same") {
  // A share of the ground of each ping is the ground of the ping before. The rest is new.
  const auto likeness = [](double share) {
    std::mt19937 random(7);
    std::exponential_distribution<double> power;
    std::normal_distribution<double> normal;
    std::vector<double> texture(drift_samples);
    for (double& value : texture) value = normal(random);
    RecordedLine line = line_of(0.0, 0.0);
    for (std::size_t i = 0; i < line.port.size(); ++i) {
      double& value = texture[i % drift_samples];
      value = share * value + std::sqrt(1.0 - share * share) * normal(random);
      if (i % drift_samples >= water_samples)
        line.port[i] =
            static_cast<float>(1000.0 * std::exp(0.5 * value) * std::sqrt(power(random)));
    }
    return lasting_likeness(line, Side::port, find_bed(line, Side::port).first_sample, 0,
                            drift_pings, 4);
  };
  CHECK(likeness(1.0) == Approx(1.0).margin(0.1));
  CHECK(likeness(0.8) == Approx(0.8 * 0.8 * 0.8).margin(0.1));
  CHECK(likeness(0.5) == Approx(0.5 * 0.5 * 0.5).margin(0.1));
}

TEST_CASE("pings that are not alike, silence and water show no drift") {
  RecordedLine line = line_of(0.0, 0.0);
  std::mt19937 random(5);
  std::exponential_distribution<double> power;
  for (std::size_t i = 0; i < line.port.size(); ++i)
    if (i % drift_samples >= water_samples)
      line.port[i] = static_cast<float>(1000.0 * std::sqrt(power(random)));
  for (float& value : line.starboard) value = 0.0f;
  CHECK_FALSE(drift_m(line, Side::port));
  CHECK_FALSE(drift_m(line, Side::starboard));
  CHECK_FALSE(sideways_drift_m(std::nullopt, 0.1));
  // The bed begins too far out, or the range is not stated.
  CHECK_FALSE(bed_drift_m(line_of(0.0, 0.0), Side::port,
                          std::vector<std::size_t>(drift_pings, drift_samples * 2 / 3), 0,
                          drift_pings));
  RecordedLine unknown = line_of(0.0, 0.0);
  for (RecordedPing& ping : unknown.pings) ping.range_m = 0.0;
  CHECK_FALSE(drift_m(unknown, Side::port));
}
