#include <ensonify/engine/sonar/vehicle/ground_path.h>

#include <cmath>
#include <numbers>

#include "support/catch.h"

using namespace ensonify::engine;

namespace {

constexpr double pi = std::numbers::pi;

TrackOptions lawn_mower(double turn_radius_m) {
  return {.kind = TrackKind::lawn_mower,
          .speed_mps = 2.0,
          .heading_rad = 0.5 * pi,
          .middle_east_m = 100.0,
          .middle_north_m = 50.0,
          .legs = 3,
          .leg_length_m = 60.0,
          .leg_spacing_m = 20.0,
          .turn_radius_m = turn_radius_m};
}

}  // namespace

TEST_CASE("a line runs through its middle at its speed and heading") {
  const TrackOptions track{.pings = 11,
                           .speed_mps = 2.0,
                           .heading_rad = 0.5 * pi,
                           .middle_east_m = 5.0,
                           .middle_north_m = 7.0};
  const std::vector<Pose> poses = generate_pings(track, 0.5).poses;
  REQUIRE(poses.size() == 11);
  CHECK((poses[5].position - Eigen::Vector3d(5.0, 7.0, 0.0)).norm() < 1e-12);
  CHECK((poses[10].position - Eigen::Vector3d(10.0, 7.0, 0.0)).norm() < 1e-12);
  CHECK(poses[10].t_s == Approx(5.0));
  CHECK(poses[10].velocity_mps.x() == Approx(2.0));
}

TEST_CASE("a lawn-mower's path is smooth, and turns of the given radius join its legs") {
  for (const double radius_m : {0.0, 6.0, 10.0, 15.0, 40.0}) {
    CAPTURE(radius_m);
    const double used_m = radius_m > 0.0 ? radius_m : 10.0;
    const GroundPath path(lawn_mower(radius_m));
    // The second leg lies 20 m to starboard of the first, which heads east from (70, 70): south of
    // it.
    const GroundPoint begin = path.at(0.0), end = path.at(path.length_m());
    CHECK((begin.place - Eigen::Vector2d(70.0, 70.0)).norm() < 1e-9);
    CHECK((end.place - Eigen::Vector2d(130.0, 30.0)).norm() < 1e-9);
    CHECK(end.course_rad == Approx(0.5 * pi));
    const GroundPoint middle = path.at(0.5 * path.length_m());
    CHECK((middle.place - Eigen::Vector2d(100.0, 50.0)).norm() < 1e-9);
    CHECK(std::remainder(middle.course_rad - 1.5 * pi, 2.0 * pi) == Approx(0.0).margin(1e-9));
    double turned_rad = 0.0, turning_m = 0.0;
    const double step_m = 0.01;
    for (double s = 0.0; s < path.length_m(); s += step_m) {
      const GroundPoint here = path.at(s), next = path.at(s + step_m);
      REQUIRE((next.place - here.place).norm() == Approx(step_m).epsilon(1e-5));
      REQUIRE(std::abs(next.course_rad - here.course_rad) <= step_m / used_m * (1.0 + 1e-6));
      const Eigen::Vector2d forward{std::sin(here.course_rad), std::cos(here.course_rad)};
      REQUIRE((next.place - here.place).dot(forward) > step_m * (1.0 - 1e-5));
      turned_rad += std::abs(next.course_rad - here.course_rad);
      turning_m += here.turning ? step_m : 0.0;
    }
    CHECK(turning_m == Approx(path.length_m() - 180.0).margin(0.1));
    if (2.0 * used_m <= 20.0) CHECK(turned_rad == Approx(2.0 * pi).epsilon(1e-3));
    if (radius_m == 0.0) CHECK(path.length_m() == Approx(180.0 + 2.0 * pi * 10.0));
  }
}

TEST_CASE("pings continue in turns, or leave them out while time continues") {
  TrackOptions track = lawn_mower(0.0);
  const std::vector<Pose> all = generate_pings(track, 0.5).poses;
  CHECK(all.size() == static_cast<std::size_t>(180.0 + 2.0 * pi * 10.0) + 1);
  CHECK(static_cast<double>(all.size()) == generated_pings(track, 0.5));
  track.ping_in_turns = false;
  const std::vector<Pose> legs = generate_pings(track, 0.5).poses;
  CHECK(legs.size() >= 180);
  CHECK(legs.size() <= 183);
  for (const Pose& pose : legs) CHECK(pose.heading_rate_radps == 0.0);
  CHECK(legs.back().t_s == all.back().t_s);
}

TEST_CASE("each leg begins with its first ping on the straight line, and the turn is behind it") {
  TrackOptions track = lawn_mower(0.0);
  for (const bool ping_in_turns : {true, false}) {
    CAPTURE(ping_in_turns);
    track.ping_in_turns = ping_in_turns;
    const GeneratedPings made = generate_pings(track, 0.5);
    REQUIRE(made.leg_starts.size() == 3);
    CHECK(made.leg_starts[0] == 0);
    const auto straight = [&](std::size_t ping) {
      return made.poses[ping].heading_rate_radps == 0.0;
    };
    for (std::size_t leg = 0; leg < 3; ++leg) {
      const std::size_t first = made.leg_starts[leg];
      const std::size_t end = leg < 2 ? made.leg_starts[leg + 1] : made.poses.size();
      // A ping per metre: 60 on the leg, and 31 in the half circle of 10 m after it.
      for (std::size_t ping = first; ping < first + 60; ++ping) CHECK(straight(ping));
      CHECK(made.poses[first].position.y() == Approx(70.0 - 20.0 * static_cast<double>(leg)));
      CHECK(straight(end - 1) == (leg == 2 || !ping_in_turns));
      CHECK(end - first >= (ping_in_turns && leg < 2 ? 60 + 30 : 60));
    }
  }
  CHECK(generate_pings({.pings = 5}, 1.0).leg_starts == std::vector<std::size_t>{0});
}

TEST_CASE("an impossible track is refused") {
  CHECK_THROWS_AS(generate_pings({.pings = 0}, 1.0), std::invalid_argument);
  CHECK_THROWS_AS(generate_pings({.speed_mps = -1.0}, 1.0), std::invalid_argument);
  TrackOptions track = lawn_mower(0.0);
  track.speed_mps = 0.0;
  CHECK_THROWS_AS(generate_pings(track, 1.0), std::invalid_argument);
  CHECK_THROWS_AS(GroundPath({.kind = TrackKind::file}), std::invalid_argument);
}
