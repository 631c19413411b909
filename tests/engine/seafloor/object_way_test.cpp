#include <ensonify/engine/seafloor/object_way.h>

#include <array>
#include <numbers>
#include <string>

#include "support/catch.h"
#include "support/files.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/scene_error.h>
#include <ensonify/engine/base/units.h>

using namespace ensonify::engine;
using namespace ensonify::tests;
using Eigen::Vector2d, Eigen::Vector3d;

TEST_CASE("an object goes through the points of its path at its speed, and looks where it goes") {
  const std::array points{Vector2d(0.0, 4.0), Vector2d(0.0, 4.0), Vector2d(-3.0, 4.0)};
  const ObjectWay way = way_along({10.0, 20.0, -7.0}, points, 2.0);
  const auto check = [&](double t_s, const Vector3d& place_m, double heading_deg) {
    CAPTURE(t_s);
    const ObjectPose pose = way.at(t_s);
    CHECK((pose.place_m - place_m).norm() < 1e-12);
    CHECK(pose.heading_rad == Approx(heading_deg * degree));
    CHECK(pose.t_s == t_s);
  };
  check(-5.0, {10.0, 20.0, -7.0}, 0.0);
  check(0.0, {10.0, 20.0, -7.0}, 0.0);
  check(1.5, {10.0, 23.0, -7.0}, 0.0);
  check(2.5, {9.0, 24.0, -7.0}, -90.0);
  check(100.0, {7.0, 24.0, -7.0}, -90.0);
  const std::array nowhere{Vector2d(0.0, 0.0)};
  CHECK_THROWS_AS(way_along({0.0, 0.0, 0.0}, nowhere, 1.0), std::invalid_argument);
}

TEST_CASE("an object follows the poses of a file, turning the shorter way") {
  const TemporaryFolder folder;
  write_text(folder / "way.csv",
             "t_s,east_m,north_m,heading_deg,pitch_deg\n1,0,0,350,0\n3,2,4,10,8\n");
  const ObjectWay way = read_way(folder / "way.csv", {5.0, 5.0, -9.0});
  CHECK((way.at(0.0).place_m - Vector3d(0.0, 0.0, -9.0)).norm() < 1e-12);
  const ObjectPose middle = way.at(2.0);
  CHECK((middle.place_m - Vector3d(1.0, 2.0, -9.0)).norm() < 1e-12);
  CHECK(std::remainder(middle.heading_rad, 2.0 * std::numbers::pi) == Approx(0.0).margin(1e-12));
  CHECK(middle.pitch_rad == Approx(4.0 * degree));
  CHECK(way.at(9.0).place_m.y() == 4.0);
  for (const auto& [text, message] :
       {std::pair<std::string, std::string>{"t_s,east_m,north_m\n0,1,1\n", "heading_deg"},
        {"t_s,east_m,north_m,heading_deg\n1,0,0,0\n1,1,1,0\n", "expected times that ascend"},
        {"t_s,east_m,north_m,heading_deg\n1,2e6,0,0\n", "a place more than"}}) {
    write_text(folder / "way.csv", text);
    CAPTURE(text);
    std::string error;
    try {
      read_way(folder / "way.csv", {0.0, 0.0, 0.0});
    } catch (const SceneError& thrown) {
      error = thrown.what();
    }
    CHECK(error.find(message) != error.npos);
  }
}
