#include <ensonify/engine/base/units.h>
#include <ensonify/engine/sonar/vehicle/recorded_track.h>

#include <cmath>

#include "support/catch.h"

using namespace ensonify::engine;

TEST_CASE("a recorded track passes through its rows and keeps constant acceleration between them") {
  NavigationLog log;
  for (const double t_s : {0.0, 1.0, 2.5, 3.0, 5.0}) {
    log.t_s.push_back(t_s);
    log.x_m.push_back(1.0 + 2.0 * t_s + 0.25 * t_s * t_s);
    log.y_m.push_back(-3.0 * t_s);
    log.z_m.push_back(-10.0 + 0.1 * t_s * t_s);
    log.roll_rad.push_back(0.01 * t_s);
  }
  const RecordedTrack track(log, 0.0);
  CHECK(track.has_height());
  CHECK_FALSE(track.altitude_m(1.0));
  for (std::size_t i = 0; i < log.t_s.size(); ++i)
    CHECK(track.at(log.t_s[i]).position.x() == log.x_m[i]);
  for (double t_s = 0.0; t_s <= 5.0; t_s += 0.1) {
    const Pose pose = track.at(t_s);
    CHECK(pose.position.x() == Approx(1.0 + 2.0 * t_s + 0.25 * t_s * t_s));
    CHECK(pose.velocity_mps.x() == Approx(2.0 + 0.5 * t_s));
    CHECK(pose.velocity_mps.y() == Approx(-3.0));
    CHECK(pose.position.z() == Approx(-10.0 + 0.1 * t_s * t_s));
    CHECK(pose.roll_rate_radps == Approx(0.01));
    // Without a heading column, the heading is the course.
    CHECK(std::remainder(pose.heading_rad - std::atan2(2.0 + 0.5 * t_s, -3.0),
                         2.0 * 180 * degree) == Approx(0.0).margin(0.01));
  }
}

TEST_CASE("headings turn through north in the shorter direction") {
  const NavigationLog log{.t_s = {0, 1, 2, 3},
                          .x_m = {0, 0, 0, 0},
                          .y_m = {0, 1, 2, 3},
                          .heading_rad = {354 * degree, 358 * degree, 2 * degree, 6 * degree}};
  const RecordedTrack track(log, 0.0);
  CHECK(track.at(1.25).heading_rad == Approx(359.0 * degree));
  CHECK(track.at(1.75).heading_rad == Approx(1.0 * degree));
  CHECK(track.at(1.5).heading_rate_radps == Approx(4.0 * degree));
}

TEST_CASE("a vehicle that stands still keeps its course and its place") {
  const NavigationLog log{
      .t_s = {0, 1, 2, 3, 4, 5}, .x_m = {0, 0, 1, 2, 2, 2}, .y_m = {0, 0, 0, 0, 0, 0}};
  const RecordedTrack track(log, 0.0);
  for (const double t_s : {0.0, 0.5, 2.0, 4.5, 5.0})
    CHECK(track.at(t_s).heading_rad == Approx(90.0 * degree).margin(1e-9));
  CHECK(track.at(4.7).position.x() == Approx(2.0).margin(1e-9));
}

TEST_CASE("a recorded track crosses a gap in its rows in a straight line") {
  // Two lines at 2 m/s, rolling, with four minutes between them.
  NavigationLog log;
  for (const double begin_s : {0.0, 260.0})
    for (int i = 0; i <= 20; ++i) {
      log.t_s.push_back(begin_s + i);
      log.x_m.push_back(begin_s == 0.0 ? 0.0 : 30.0);
      log.y_m.push_back(begin_s == 0.0 ? 2.0 * i : 40.0 - 2.0 * i);
      log.z_m.push_back(-10.0 + 0.2 * std::sin(0.5 * i));
      log.heading_rad.push_back(begin_s == 0.0 ? 5.0 * degree * i : 180.0 * degree);
    }
  for (const double smooth_s : {0.0, 2.0}) {
    const RecordedTrack track(log, smooth_s);
    for (double t_s = 20.0; t_s <= 260.0; t_s += 0.5) {
      CAPTURE(smooth_s, t_s);
      const double share = (t_s - 20.0) / 240.0;
      const Pose pose = track.at(t_s);
      CHECK(pose.position.x() == Approx(30.0 * share).margin(0.2));
      CHECK(pose.position.y() == Approx(40.0).margin(0.5));
      CHECK(std::abs(pose.position.z() + 10.0) < 0.25);
      CHECK(pose.heading_rad == Approx((100.0 + 80.0 * share) * degree).margin(1e-6));
    }
    CHECK(track.at(20.0).velocity_mps.y() == Approx(2.0).margin(0.2));
    CHECK(track.at(260.0).velocity_mps.y() == Approx(-2.0).margin(0.2));
  }
  // Also at the ends.
  const NavigationLog late{.t_s = {0, 1, 2, 1000}, .x_m = {0, 0, 0, 0}, .y_m = {0, 5, 10, 11}};
  CHECK(RecordedTrack(late, 0.0).at(1000.0).velocity_mps.y() == Approx(1.0 / 998.0));
  CHECK(RecordedTrack(late, 0.0).at(500.0).position.y() == Approx(10.5).margin(0.01));
}

TEST_CASE("smoothing keeps a steady course, though every place is repeated and rounded") {
  NavigationLog log;
  const double speed_mps = 0.9, step_m = 0.18;
  for (int i = 0; i < 400; ++i) {
    const int fix = i / 2 * 2;
    const double t_s = 0.12 * i, fix_s = 0.12 * fix;
    log.t_s.push_back(t_s);
    log.x_m.push_back(std::round(speed_mps * fix_s / step_m) * step_m);
    log.y_m.push_back(-2.0 * fix_s);
  }
  CHECK(log.repeated_places() == 200);
  const RecordedTrack raw(log, 0.0), smooth(log, 3.0);
  double slowest_mps = 10.0, fastest_mps = 0.0;
  for (double t_s = 2.0; t_s < 45.0; t_s += 0.037) {
    const Pose pose = smooth.at(t_s);
    CHECK(pose.position.y() == Approx(-2.0 * t_s).margin(1e-9));
    CHECK(pose.position.x() == Approx(speed_mps * t_s).margin(0.03));
    slowest_mps = std::min(slowest_mps, pose.velocity_mps.x());
    fastest_mps = std::max(fastest_mps, pose.velocity_mps.x());
  }
  CHECK(slowest_mps > 0.85);
  CHECK(fastest_mps < 0.95);
  CHECK(raw.at(3.06).velocity_mps.y() !=
        Approx(-2.0).margin(0.5));  // without smoothing it stops at every second row
}

TEST_CASE("smoothing a track of many rows gives what a sixtieth of its rows give") {
  const auto track = [](int rows_per_s) {
    NavigationLog log;
    for (int i = 0; i <= 900 * rows_per_s; ++i) {
      const double t_s = static_cast<double>(i) / rows_per_s;
      log.t_s.push_back(t_s);
      log.x_m.push_back(1.5 * t_s);
      log.y_m.push_back(20.0 * std::sin(0.01 * t_s));
    }
    return RecordedTrack(log, 60.0);
  };
  const RecordedTrack sparse = track(1);
  const RecordedTrack dense = track(60);
  for (double t_s = 0.0; t_s <= 900.0; t_s += 30.0) {
    CHECK(dense.at(t_s).position.x() == Approx(1.5 * t_s).margin(1e-6));
    CHECK(dense.at(t_s).position.y() == Approx(sparse.at(t_s).position.y()).margin(0.05));
  }
}

TEST_CASE("columns of different lengths and times that do not ascend are refused") {
  CHECK_THROWS_AS(RecordedTrack({}, 0.0), std::invalid_argument);
  CHECK_THROWS_AS(RecordedTrack({.t_s = {0, 1}, .x_m = {0, 1}, .y_m = {0}}, 0.0),
                  std::invalid_argument);
  CHECK_THROWS_AS(RecordedTrack({.t_s = {1, 1}, .x_m = {0, 1}, .y_m = {0, 1}}, 0.0),
                  std::invalid_argument);
}
