#include <ensonify/engine/sonar/vehicle/motion.h>

#include <cmath>
#include <numbers>

#include "support/catch.h"

#include <ensonify/engine/sonar/vehicle/ground_path.h>

using namespace ensonify::engine;

namespace {

/// The correlation of an oscillator at a lag, estimated from 4000 seeds at a few times each.
double correlation(const Oscillation& oscillation, double lag_s) {
  double sum = 0.0;
  int count = 0;
  for (std::uint64_t seed = 0; seed < 4000; ++seed) {
    const Oscillator oscillator(oscillation, seed, 0);
    for (const double t_s : {0.0, 333.0, 7777.0}) {
      sum += oscillator.at(t_s) * oscillator.at(t_s + lag_s);
      ++count;
    }
  }
  return sum / count;
}

MotionOptions lively() {
  const Oscillation angle{.rms = 0.05, .period_s = 5.0, .wander_rms = 0.02, .wander_s = 30.0};
  const Oscillation shift{.rms = 0.3, .period_s = 7.0, .wander_rms = 0.5, .wander_s = 20.0};
  return {.roll_rad = 0.1,
          .pitch_rad = -0.2,
          .crab_rad = 0.05,
          .roll = angle,
          .pitch = angle,
          .heading = angle,
          .heave = shift,
          .sway = shift,
          .surge = shift,
          .speed = {.rms = 0.2, .wander_rms = 0.3}};
}

}  // namespace

TEST_CASE(
    "the periodic band has its rms, period and bandwidth, the slow band its correlation time") {
  const Oscillation waves{.rms = 2.0, .period_s = 6.0};
  const double w0 = 2.0 * std::numbers::pi / 6.0, s = 0.15 * w0;
  for (const double lag_s : {0.0, 1.5, 3.0, 6.0, 9.0, 12.0, 30.0}) {
    CAPTURE(lag_s);
    const double expected = std::exp(-0.5 * s * s * lag_s * lag_s) * std::cos(w0 * lag_s);
    CHECK(correlation(waves, lag_s) / 4.0 == Approx(expected).margin(0.04));
  }
  const Oscillation slow{.wander_rms = 2.0, .wander_s = 40.0};
  for (const double lag_s : {0.0, 20.0, 40.0, 80.0, 200.0}) {
    CAPTURE(lag_s);
    const double expected = std::exp(-0.5 * lag_s * lag_s / 1600.0);
    CHECK(correlation(slow, lag_s) / 4.0 == Approx(expected).margin(0.04));
  }
}

TEST_CASE("over an hour one vehicle's roll has its rms and crosses zero at its period") {
  const Oscillator roll({.rms = 0.05, .period_s = 6.0}, 0, 0);  // 0 is a valid seed
  double squares = 0.0;
  int upward = 0, samples = 0;
  for (double t_s = 0.0; t_s < 3600.0; t_s += 0.05, ++samples) {
    squares += roll.at(t_s) * roll.at(t_s);
    upward += roll.at(t_s) < 0.0 && roll.at(t_s + 0.05) >= 0.0;
  }
  CHECK(std::sqrt(squares / samples) == Approx(0.05).epsilon(0.03));
  // Rice's formula: the crossing rate follows from the mean of the squared frequency.
  CHECK(3600.0 / upward == Approx(6.0 / std::sqrt(1.0 + 0.15 * 0.15)).epsilon(0.02));
}

TEST_CASE("seeds and degrees of freedom move differently, and zero motion changes no pose") {
  const Oscillation waves{.rms = 1.0};
  CHECK(Oscillator(waves, 0, 0).at(1.0) != Oscillator(waves, 1, 0).at(1.0));
  CHECK(Oscillator(waves, 0, 0).at(1.0) != Oscillator(waves, 0, 1).at(1.0));
  const Pose pose{.t_s = 3.0, .position = {1.0 / 3.0, 2.0, -7.0}, .heading_rad = 1.1};
  const Pose same = Motion({}, 5).applied_to(pose);
  CHECK(same.position == pose.position);
  CHECK(same.heading_rad == pose.heading_rad);
  CHECK(same.velocity_mps == pose.velocity_mps);
  CHECK_THROWS_AS(Oscillator({.rms = -1.0}, 0, 0), std::invalid_argument);
  CHECK_THROWS_AS(Oscillator({.rms = 1.0, .period_s = 0.0}, 0, 0), std::invalid_argument);
}

TEST_CASE("rates are the derivatives of the poses, in legs and in turns") {
  const TrackOptions track{.kind = TrackKind::lawn_mower,
                           .speed_mps = 2.0,
                           .heading_rad = 0.3,
                           .legs = 2,
                           .leg_length_m = 20.0,
                           .leg_spacing_m = 12.0};
  const Motion motion(lively(), 9);
  const double step_s = 1e-3;
  std::vector<Pose> poses = generate_pings(track, step_s, motion.speed()).poses;
  for (Pose& pose : poses) pose = motion.applied_to(pose);
  std::size_t turning = 0;
  for (std::size_t i = 1; i + 1 < poses.size(); i += 97) {
    const Pose &before = poses[i - 1], &here = poses[i], &after = poses[i + 1];
    const double two_s = after.t_s - before.t_s;
    // The heading rate jumps where a leg meets a turn.
    if (std::abs(after.heading_rate_radps - before.heading_rate_radps) > 0.01) continue;
    turning += std::abs(here.heading_rate_radps) > 0.2;
    const Eigen::Vector3d velocity = (after.position - before.position) / two_s;
    REQUIRE((velocity - here.velocity_mps).norm() < 1e-5);
    REQUIRE((after.roll_rad - before.roll_rad) / two_s ==
            Approx(here.roll_rate_radps).margin(1e-6));
    REQUIRE((after.pitch_rad - before.pitch_rad) / two_s ==
            Approx(here.pitch_rate_radps).margin(1e-6));
    REQUIRE((after.heading_rad - before.heading_rad) / two_s ==
            Approx(here.heading_rate_radps).margin(1e-5));
  }
  CHECK(turning > 20);
}
