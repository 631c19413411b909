// Poses of a session: those that are refused, and those off the seafloor.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/beds.h"
#include "support/catch.h"
#include "support/session_scenes.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/simulator/session_objects.h>
#include <ensonify/engine/trace/face_sources/static_faces.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

TEST_CASE("a pose with any number that is not finite is refused, and so is an absurd rate") {
  Simulator session(bare_scene());
  const std::uint32_t instance = session.add({.mesh = cube(1.0f)}, {.position = {10, 0, -13}});
  const auto refused = [&](const Pose& pose) {
    CHECK_THROWS_AS(session.ping(pose), std::invalid_argument);
    CHECK_THROWS_AS(session.add({.mesh = cube(1.0f)}, pose), std::invalid_argument);
    CHECK_THROWS_AS(session.move(instance, pose), std::invalid_argument);
  };
  using Number = double& (*)(Pose&);
  static constexpr std::array<Number, 3> rates{
      [](Pose& p) -> double& { return p.roll_rate_radps; },
      [](Pose& p) -> double& { return p.pitch_rate_radps; },
      [](Pose& p) -> double& { return p.heading_rate_radps; }};
  static constexpr std::array<Number, 10> others{
      [](Pose& p) -> double& { return p.t_s; },
      [](Pose& p) -> double& { return p.position.x(); },
      [](Pose& p) -> double& { return p.position.y(); },
      [](Pose& p) -> double& { return p.position.z(); },
      [](Pose& p) -> double& { return p.roll_rad; },
      [](Pose& p) -> double& { return p.pitch_rad; },
      [](Pose& p) -> double& { return p.heading_rad; },
      [](Pose& p) -> double& { return p.velocity_mps.x(); },
      [](Pose& p) -> double& { return p.velocity_mps.y(); },
      [](Pose& p) -> double& { return p.velocity_mps.z(); }};
  const auto with = [](Number number, double value) {
    Pose pose = beside;
    number(pose) = value;
    return pose;
  };
  for (const double value : {std::nan(""), infinity, -infinity}) {
    for (const Number number : rates) refused(with(number, value));
    for (const Number number : others) refused(with(number, value));
  }
  for (const Number rate : rates) {
    for (const double value : {1e308, -1e308, 2e4}) refused(with(rate, value));
    for (const EchoLine& line : session.ping(with(rate, 1.7e4)))
      for (const float intensity : line.bins.intensity_mean) REQUIRE(std::isfinite(intensity));
  }
}

TEST_CASE("a ping out of reach of the seafloor warns once, and one as fast as sound is refused") {
  Simulator session(bare_scene());
  const std::size_t before = session.warnings().size();
  const auto at = [](double x_m) { return Pose{.position = {x_m, 0.0, -7.0}}; };
  session.ping(at(0.0));
  session.ping(at(45.0));  // off the seafloor, which is still in range
  CHECK(session.warnings().size() == before);
  session.ping(at(5000.0));
  session.ping(at(6000.0));
  REQUIRE(session.warnings().size() == before + 1);
  CHECK_THAT(
      session.warnings().back(),
      Catch::Contains("5000.0 m east, 0.0 m north, -7.0 m up is 4975.0 m from the seafloor"));
  Pose fast = beside;
  fast.velocity_mps = {0.0, 2000.0, 0.0};
  CHECK_THROWS_WITH(session.ping(fast), Catch::Contains("velocity is 2000 m/s, expected less"));
  // A sonar on a lever of 2 m, in a vehicle that turns: on a circle, rate times radius.
  Scene scene = bare_scene();
  scene.sonars.front().mounting.forward_m = 2.0;
  Simulator on_lever(scene);
  Pose turning = at(0.0);
  turning.heading_rate_radps = 5.0;
  on_lever.ping(turning);
  turning.heading_rate_radps = 800.0;
  CHECK_THROWS_WITH(on_lever.ping(turning),
                    Catch::Contains("the pose's rates move sonar") &&
                        Catch::Contains("at 1600 m/s, expected less than the speed of sound"));
}

TEST_CASE("a pose that puts a sonar out of the water is refused as in a run, on each face source") {
  using Catch::Contains;
  Scene scene = bare_scene();
  scene.track.pings = 1;
  Sonar hung = scene.sonars.front();
  hung.name = "hung";
  hung.mounting.down_m = 5.0;
  for (const bool mounted : {false, true}) {
    if (mounted) scene.sonars.push_back(hung);
    for (const std::string surface : {"static", "refined", "footprint"}) {
      CAPTURE(surface, mounted);
      scene.run.surface = surface;
      Simulator session(scene);
      const double bed_m = -session.altitude_m({0.3, 0.2, 0.0});
      const double below_m = mounted ? hung.mounting.down_m : 0.0;  // the lowest sonar
      const auto at = [](double z_m) { return Pose{.position = {0.3, 0.2, z_m}}; };
      const auto first = numbers(session.ping(at(-7.0)));
      const std::string below = mounted ? "sonar hung 1.0 m below the bed" : "1.0 m below the bed";
      CHECK_THROWS_WITH(session.ping(at(bed_m + below_m - 1.0)), Contains(below));
      CHECK_THROWS_WITH(session.ping(at(3.0)),
                        Contains("sonar sidescan 3.0 m above the sea surface"));
      for (const double z_m : {0.0, 1.0, 1000.0, bed_m + below_m, bed_m + below_m - 1e-6, -1000.0})
        CHECK_THROWS_AS(session.ping(at(z_m)), std::invalid_argument);
      CHECK_THROWS_AS(SimulatorInternals::hits(session, at(1.0)), std::invalid_argument);
      Simulator other(scene);
      CHECK_NOTHROW(other.ping_numbered(at(-1e-6), 0));
      CHECK_NOTHROW(other.ping_numbered(at(bed_m + below_m + 1e-6), 0));
      CHECK(numbers(session.ping_numbered(at(-7.0), 0)) == first);
      // None of these was a ping: the session's next is still number 1.
      const auto second = numbers(session.ping(at(-7.0)));
      CHECK(second != first);
      CHECK(second == numbers(session.ping_numbered(at(-7.0), 1)));

      // A run has the same limits.
      for (const double over_m : {-0.05, 0.05}) {
        Scene flown = scene;
        flown.track.middle_east_m = 0.3;
        flown.track.middle_north_m = 0.2;
        flown.track.altitude_m = below_m + over_m;
        if (flown.track.altitude_m <= 0.0) continue;
        const bool accepted = [&] {
          try {
            return !Simulator(flown).track().empty();
          } catch (const SceneError&) {
            return false;
          }
        }();
        CHECK(accepted == (over_m > 0.0));
      }
    }
  }
}

TEST_CASE("a sonar off the seafloor or over a hole pings and receives what it can reach") {
  Scene scene = bare_scene();
  scene.speckle = false;
  Simulator session(scene);
  CHECK(std::isnan(session.altitude_m({30.0, 0.0, -7.0})));
  const auto lines =
      session.ping_numbered({.position = {30.0, 0.0, -7.0}}, 0);  // 5 m beyond the edge
  const auto heard = [](const EchoLine& line) {
    return std::ranges::count_if(line.bins.intensity_mean, [](float i) { return i > 0.0f; });
  };
  CHECK(heard(lines[0]) > 0);  // port looks west, at the bed
}

TEST_CASE("below the mean of the bed, but over none, other paths have a finite level") {
  Scene scene = bare_scene();
  scene.speckle = false;
  scene.arrivals.volume = scene.arrivals.multiples = scene.arrivals.second_time_around = true;
  Simulator session(scene);
  for (const double z_m : {-15.5, -20.0, -500.0}) {
    CAPTURE(z_m);
    for (const EchoLine& line : session.ping_numbered({.position = {30.0, 0.0, z_m}}, 0))
      CHECK(
          std::ranges::all_of(line.bins.intensity, [](float i) { return i > 0.0f && i < 1e30f; }));
  }
}

TEST_CASE("where the water absorbs an echo to nothing, other paths have a finite level") {
  Scene scene = bare_scene();
  scene.sonars.front().frequency_hz = 2e6;
  scene.sonars.front().range_m = 3000.0;
  scene.speckle = false;
  using Path = bool OtherPathsOptions::*;
  for (const Path path : {&OtherPathsOptions::second_time_around, &OtherPathsOptions::surface,
                          &OtherPathsOptions::volume, &OtherPathsOptions::multiples}) {
    scene.arrivals = {};
    scene.arrivals.*path = true;
    Simulator session(scene);
    for (const EchoLine& line : session.ping(beside))
      CHECK(
          std::ranges::all_of(line.bins.intensity, [](float i) { return i >= 0.0f && i < 1e30f; }));
  }
}
