#include <numbers>

#include <Eigen/LU>

#include "support/catch.h"

#include <ensonify/engine/sonar/echo/ray_layout.h>
#include <ensonify/engine/sonar/vehicle/track.h>

using namespace ensonify::engine;
using Eigen::Vector3d;

namespace {
bool near(const Vector3d& a, const Vector3d& b) { return (a - b).norm() < 1e-12; }
}  // namespace

TEST_CASE("heading east, the bow looks east and starboard is south") {
  const Eigen::Matrix3d body = body_to_world({.heading_rad = std::numbers::pi / 2.0});
  CHECK(near(body.col(0), Vector3d::UnitX()));
  CHECK(near(body.col(1), -Vector3d::UnitY()));
  CHECK(near(body.col(2), -Vector3d::UnitZ()));
}

TEST_CASE("pitch lifts the nose, roll lowers starboard") {
  CHECK(body_to_world({.pitch_rad = 0.1}).col(0).z() == Approx(std::sin(0.1)));
  CHECK(body_to_world({.roll_rad = 0.1}).col(1).z() == Approx(-std::sin(0.1)));
}

TEST_CASE("heading, pitch and roll are applied in that order") {
  const Pose pose{.roll_rad = 0.3, .pitch_rad = 0.2, .heading_rad = 0.1};
  const Eigen::Matrix3d body = body_to_world(pose);
  // Roll does not change the nose's direction: its elevation is the pitch, its bearing the heading.
  CHECK(body.col(0).z() == Approx(std::sin(0.2)));
  CHECK(std::atan2(body.col(0).x(), body.col(0).y()) == Approx(0.1));
  CHECK(body.col(1).z() == Approx(-std::cos(0.2) * std::sin(0.3)));
  CHECK(body.determinant() == Approx(1.0));
}

TEST_CASE("a fan looks to its side, and its pole points upwards") {
  const Sonar sonar{.sector_high_rad = 0.5 * std::numbers::pi};
  const RayLayout layout = make_ray_layout(sonar, 0.00375, 7.5);
  const Pose north{};
  const RayFan starboard = place_fan(layout, north, starboard_sector, 75.0);
  const RayFan port = place_fan(layout, north, port_sector, 75.0);
  CHECK(starboard.middle.x() > 0.5);
  CHECK(port.middle.x() < -0.5);
  CHECK(starboard.pole.z() > 0.0);
  CHECK(port.pole.z() > 0.0);
  // First elevation straight down, last one 10 degrees above the horizontal (of a middle plane).
  const std::size_t plane = starboard.planes() / 2;
  CHECK(starboard.ray(plane, 0).direction.z() == Approx(-1.0).margin(1e-4));
  CHECK(starboard.ray(plane, starboard.elevations() - 1).direction.z() ==
        Approx(std::sin(0.1745329)).margin(1e-4));
}
