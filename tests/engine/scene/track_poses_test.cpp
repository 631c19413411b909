#include <ensonify/engine/scene/track_poses.h>

#include <cmath>
#include <fstream>
#include <limits>

#include <fmt/format.h>

#include "support/catch.h"
#include "support/message.h"
#include "support/temporary_folder.h"

using namespace ensonify;
using namespace ensonify::engine;
using tests::TemporaryFolder;

namespace {

/// A bed 20 m deep that steps up by 6 m at y = 0.
const Ground step{.bed_height_m = [](double, double y_m) { return y_m < 0.0 ? -20.0 : -14.0; },
                  .lowest = {-100.0, -100.0},
                  .highest = {100.0, 100.0},
                  .frame = {}};

std::string refusal(const Scene& scene, const Ground& ground = step) {
  return tests::message_thrown<SceneError>([&] { build_track(scene, ground, 1500.0); }, "accepted");
}

Scene from_file(const TemporaryFolder& folder, const std::string& text) {
  std::ofstream(folder / "track.csv") << text;
  Scene scene;
  scene.track.kind = TrackKind::file;
  scene.track.file = {"track.csv", folder / "track.csv"};
  return scene;
}

}  // namespace

TEST_CASE(
    "a line keeps its height over the mean bed, with one ping per two-way time of the longest range") {
  Scene scene;
  scene.track.pings = 201;
  scene.sonars.push_back(scene.sonars.front());
  scene.sonars.back().range_m = 150.0;
  const std::vector<Pose> poses = build_track(scene, step, 1500.0).poses;
  CHECK(poses[1].t_s == 0.2);
  for (const Pose& pose : poses)
    CHECK(pose.position.z() == Approx(10.0 - 14.0 - 6.0 * 100.0 / 201.0));
}

TEST_CASE("an altitude is kept with its time constant, and no faster than the vehicle climbs") {
  Scene scene;
  scene.track.pings = 800;
  scene.track.ping_interval_s = 0.1;
  scene.track.speed_mps = 1.0;
  scene.track.altitude_m = 8.0;
  scene.track.vertical = Vertical::altitude;
  scene.track.climb_mps = 100.0;
  const auto at = [](const std::vector<Pose>& poses, double t_s) {
    return poses[static_cast<std::size_t>(std::lround(t_s / 0.1))].position.z();
  };
  const std::vector<Pose> free = build_track(scene, step, 1500.0).poses;  // y = 0 at 39.95 s
  CHECK(at(free, 39.9) == Approx(-12.0));
  CHECK(at(free, 39.9 + 5.0) == Approx(-6.0 - 6.0 * std::exp(-1.0)));
  CHECK(at(free, 79.9) == Approx(-6.0).margin(0.01));
  scene.track.climb_mps = 0.25;
  const std::vector<Pose> slow = build_track(scene, step, 1500.0).poses;
  CHECK(at(slow, 39.9 + 12.0) == Approx(-9.0));
  for (std::size_t i = 0; i + 1 < slow.size(); ++i) {
    const double climb_m = slow[i + 1].position.z() - slow[i].position.z();
    REQUIRE(climb_m <= 0.025 + 1e-12);
    REQUIRE(climb_m == Approx(0.1 * slow[i].velocity_mps.z()).margin(1e-12));
  }
  scene.track.follow_s = 0.0;
  scene.track.climb_mps = 100.0;
  for (const Pose& pose : build_track(scene, step, 1500.0).poses)
    REQUIRE(pose.position.z() - step.bed_height_m(0.0, pose.position.y()) == Approx(8.0));
}

TEST_CASE("over a hole the altitude is that over the last bed") {
  Ground holed = step;
  holed.bed_height_m = [](double, double y_m) {
    return std::abs(y_m) < 5.0 ? std::numeric_limits<double>::quiet_NaN() : -20.0;
  };
  Scene scene;
  scene.track.pings = 100;
  scene.track.vertical = Vertical::altitude;
  for (const Pose& pose : build_track(scene, holed, 1500.0).poses)
    CHECK(pose.position.z() == Approx(-10.0));
}

TEST_CASE("a recorded track pings at its rows, or at the interval it is given") {
  const TemporaryFolder folder;
  Scene scene = from_file(folder, "t_s,x_m,y_m,z_m\n10,0,0,-5\n11,2,0,-5\n14,8,0,-5\n");
  std::vector<Pose> poses = build_track(scene, step, 1500.0).poses;
  REQUIRE(poses.size() == 3);
  CHECK(poses[2].t_s == 14.0);
  CHECK(poses[2].position == Eigen::Vector3d(8.0, 0.0, -5.0));
  scene.track.ping_interval_s = 0.4;
  poses = build_track(scene, step, 1500.0).poses;
  REQUIRE(poses.size() == 11);
  CHECK(poses[10].t_s == 14.0);
  CHECK(poses[5].position.x() == Approx(4.0));
  CHECK(poses[5].heading_rad == Approx(std::acos(0.0)));
}

TEST_CASE("a recorded altitude is held over this bed where no depth is known, or on request") {
  const TemporaryFolder folder;
  Scene scene = from_file(folder, "t_s,x_m,y_m,altitude_m\n0,0,-9,4\n1,0,-8,4\n2,0,-7,5\n");
  scene.track.follow_s = 0.0;
  scene.track.climb_mps = 10.0;
  CHECK(build_track(scene, step, 1500.0).poses[2].position.z() == Approx(-15.0));
  scene = from_file(folder, "t_s,x_m,y_m,depth_m,altitude_m\n0,0,-9,3,4\n1,0,-8,3,4\n");
  CHECK(build_track(scene, step, 1500.0).poses[1].position.z() == -3.0);
  scene.track.vertical = Vertical::altitude;
  CHECK(build_track(scene, step, 1500.0).poses[1].position.z() == Approx(-16.0));
  scene = from_file(folder, "t_s,x_m,y_m\n0,0,-9\n1,0,-8\n");
  CHECK(build_track(scene, step, 1500.0).poses[1].position.z() == Approx(-10.0));
}

TEST_CASE("repeated positions give a warning, unless they are smoothed") {
  const TemporaryFolder folder;
  Scene scene = from_file(folder, "t_s,x_m,y_m\n0,0,0\n1,0,0\n2,2,0\n3,2,0\n");
  CHECK(build_track(scene, step, 1500.0).warnings.size() == 1);
  scene.track.smooth_s = 2.0;
  CHECK(build_track(scene, step, 1500.0).warnings.empty());
}

TEST_CASE("pings in a pause of a recorded track are counted in a warning") {
  const TemporaryFolder folder;
  const auto warnings = [&](const std::string& rows, double interval_s) {
    Scene scene = from_file(folder, "t_s,x_m,y_m,z_m\n" + rows);
    scene.track.ping_interval_s = interval_s;
    return build_track(scene, step, 1500.0).warnings;
  };
  std::string rows;
  const auto add = [&](int first_s, int end_s) {
    for (int t_s = first_s; t_s < end_s; ++t_s) rows += fmt::format("{},{},0,-5\n", t_s, 0.1 * t_s);
  };
  add(0, 20);
  add(25, 40);
  CHECK(warnings(rows, 0.5).empty());  // some lost rows are no pause
  add(99, 120);
  // Rows at 39 and 99 s: pings at 39.5, 40 ... 98.5 s.
  REQUIRE(warnings(rows, 0.5).size() == 1);
  CHECK_THAT(warnings(rows, 0.5).front(),
             Catch::StartsWith(
                 "track.csv: 119 of 239 pings lie in a pause of its rows, 60 s from t_s 39;"));
  CHECK(warnings(rows, 0.0).empty());  // a ping per row
  add(320, 340);
  CHECK_THAT(warnings(rows, 1.0).front(),
             Catch::Contains("259 of 340 pings lie in 2 pauses of its rows, the longest 201 s"));
  // Ends of straight legs.
  CHECK(warnings("0,0,0,-5\n60,60,0,-5\n61,60,1,-5\n62,60,2,-5\n122,0,2,-5\n", 1.0).empty());
}

TEST_CASE("an error for an impossible track tells the user what to do") {
  using Catch::Contains;
  Scene scene;
  scene.track.kind = TrackKind::lawn_mower;
  scene.track.legs = 20;
  CHECK_THAT(refusal(scene), Contains("off the seafloor") && Contains("use fewer track.legs"));
  scene.track.leg_length_m = 1e6;
  scene.track.legs = 10000;
  CHECK_THAT(refusal(scene), Contains("use fewer pings"));
  const TemporaryFolder folder;
  scene = from_file(folder, "t_s,x_m,y_m,z_m\n0,0,0,-15\n");
  CHECK_THAT(refusal(scene), Contains("at ping 0 the vehicle is 1.0 m below the bed"));
  scene = from_file(folder, "t_s,x_m,y_m,z_m\n0,0,0,1\n");
  CHECK_THAT(refusal(scene), Contains("1.0 m above the sea surface"));
  scene = from_file(folder, "t_s,x_m,y_m,z_m\n0,0,0,-10\n");
  scene.sonars.front().mounting.down_m = 4.5;
  CHECK_THAT(refusal(scene), Contains("sonar sidescan is 0.5 m below the bed"));
  scene.sonars.front().mounting.down_m = 3.5;
  CHECK(refusal(scene) == "accepted");
  // Depths that count downwards, with a part that falls dry.
  Ground upside_down = step;
  upside_down.bed_height_m = [](double, double y_m) { return y_m < 90.0 ? 12.0 : -1.0; };
  scene = {};
  scene.seafloor.kind = SeafloorKind::survey;
  CHECK_THAT(
      refusal(scene, upside_down),
      Contains("the bed there rises 12.0 m above the sea surface: move the track to where") &&
          Contains("change the sign of the survey's heights if they are depths"));
  scene.seafloor.kind = SeafloorKind::mesh;
  CHECK_THAT(refusal(scene, upside_down),
             Contains("the bed there rises 12.0 m above") && !Contains("the survey's heights"));
  scene = from_file(folder, "t_s,x_m,y_m,z_m\n0,0,0,-10\n");
  scene.track.ping_interval_s = 1e-9;
  scene.track.file.path = folder / "none.csv";
  CHECK_THAT(refusal(scene), Contains("none.csv"));
}

TEST_CASE("a vehicle or a sonar on a lever that moves as fast as sound is refused") {
  Scene scene;
  scene.track.pings = 20;
  scene.motion.heading = {.rms = 1.0, .period_s = 0.1};  // about 60 radians per second
  CHECK(refusal(scene) == "accepted");
  scene.sonars.front().mounting.forward_m = 60.0;
  const std::string sonar = refusal(scene);
  CHECK_THAT(sonar, Catch::StartsWith("track: at ping ") &&
                        Catch::Contains("sonar sidescan moves at ") &&
                        Catch::Contains("m/s, expected less than the speed of sound, 1500 m/s"));
  scene = {};
  scene.track.pings = 2;
  scene.track.ping_interval_s = 0.01;
  scene.track.speed_mps = 2000.0;
  CHECK_THAT(refusal(scene), Catch::StartsWith("track: at ping 0 the vehicle moves at 2000 m/s"));
}
