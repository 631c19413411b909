#include <ensonify/engine/sonar/instrument/mounting.h>

#include <numbers>

#include "support/catch.h"

#include <ensonify/engine/sonar/echo/ray_layout.h>

using namespace ensonify::engine;
using Eigen::Vector3d;

namespace {
constexpr double right_angle = std::numbers::pi / 2.0;
}

TEST_CASE("turned to port, a sonar's starboard side looks ahead from where it is mounted") {
  const Pose east{.position = {1.0, 2.0, -5.0}, .heading_rad = right_angle};
  const Pose sonar = mounted(
      east, {.forward_m = 0.8, .starboard_m = 0.3, .down_m = 0.2, .azimuth_rad = -right_angle});
  CHECK((sonar.position - Vector3d(1.8, 1.7, -5.2)).norm() < 1e-12);
  const RayFan fan = place_fan(make_ray_layout({.sector_high_rad = right_angle}, 0.00375, 7.5),
                               sonar, starboard_sector, 75.0);
  CHECK(fan.middle.x() > 0.5);
  CHECK(std::abs(fan.middle.y()) < 1e-12);
  CHECK(fan.middle.z() < -0.5);
}

TEST_CASE("a mounting turns with its vehicle: its axes are the product of both turns") {
  const Pose vehicle{.roll_rad = 0.2, .pitch_rad = -0.3, .heading_rad = 2.0};
  const Eigen::Matrix3d body = body_to_world(vehicle);
  const Eigen::Matrix3d up = body_to_world(mounted(vehicle, {.pitch_rad = 0.1}));
  CHECK((up.col(0) - (std::cos(0.1) * body.col(0) - std::sin(0.1) * body.col(2))).norm() < 1e-12);
  CHECK((up.col(1) - body.col(1)).norm() < 1e-12);
  const Eigen::Matrix3d turned = body_to_world(mounted(vehicle, {.azimuth_rad = 0.4}));
  CHECK((turned.col(0) - (std::cos(0.4) * body.col(0) + std::sin(0.4) * body.col(1))).norm() <
        1e-12);
  CHECK((turned.col(2) - body.col(2)).norm() < 1e-12);
}

TEST_CASE("a mounted sonar's rates are the derivatives of its pose") {
  const Mounting mounting{
      .forward_m = 1.5, .starboard_m = -0.4, .down_m = 0.7, .azimuth_rad = -1.2, .pitch_rad = 0.3};
  const Pose vehicle{.position = {1.0, 2.0, -5.0},
                     .roll_rad = 0.2,
                     .pitch_rad = -0.3,
                     .heading_rad = 0.7,
                     .velocity_mps = {1.0, 2.0, 0.1},
                     .roll_rate_radps = 0.3,
                     .pitch_rate_radps = -0.2,
                     .heading_rate_radps = 0.15};
  const double h = 1e-5;
  const Pose before = mounted(vehicle.after(-h), mounting),
             after = mounted(vehicle.after(h), mounting);
  const Pose now = mounted(vehicle, mounting);
  CHECK(((after.position - before.position) / (2 * h) - now.velocity_mps).norm() < 1e-8);
  CHECK((after.roll_rad - before.roll_rad) / (2 * h) == Approx(now.roll_rate_radps).epsilon(1e-7));
  CHECK((after.pitch_rad - before.pitch_rad) / (2 * h) ==
        Approx(now.pitch_rate_radps).epsilon(1e-7));
  CHECK((after.heading_rad - before.heading_rad) / (2 * h) ==
        Approx(now.heading_rate_radps).epsilon(1e-7));
}
