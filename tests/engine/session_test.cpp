// Sessions of a Simulator: pings in turn, changed settings, calls that are refused.

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
#include "support/files.h"
#include "support/session_scenes.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/simulator/session_objects.h>
#include <ensonify/engine/trace/face_sources/static_faces.h>

using namespace ensonify;
using namespace ensonify::engine;
using namespace ensonify::tests;

TEST_CASE("the pings of a session are numbered in order") {
  Simulator session(bare_scene()), other(bare_scene());
  for (const std::uint64_t number : {0u, 1u, 2u}) {
    Pose pose = beside;
    pose.position.y() += static_cast<double>(number);
    pose.t_s = 0.1 * static_cast<double>(number);
    const std::vector<double> of_session = numbers(session.ping(pose));
    CHECK(of_session == numbers(other.ping_numbered(pose, number)));
  }
}

TEST_CASE("a longer range changes the echoes of earlier pings as in a scene that has it") {
  Scene scene = bare_scene();
  scene.arrivals.second_time_around = true;
  Scene longer = scene;
  longer.sonars.front().range_m = 40.0;
  Simulator session(scene), expected(longer);
  session.ping_numbered(beside, 0);
  session.set_sonar(0, longer.sonars.front());
  CHECK(numbers(session.ping_numbered(beside, 0)) == numbers(expected.ping_numbered(beside, 0)));
}

TEST_CASE("a sonar can be set while another one's sampled range is longer than a scene may have") {
  Scene scene = bare_scene();
  Sonar& far = scene.sonars.emplace_back(scene.sonars.front());
  far.name = "far";
  far.range_m = 20000.0;
  far.sample_rate_hz = 77.0;
  Simulator session(scene);
  REQUIRE(session.sonars()[1].range_m > 20000.0);
  Sonar changed = scene.sonars.front();
  changed.range_m = 20.0;
  CHECK_NOTHROW(session.set_sonar(0, changed));
}

TEST_CASE("a sonar that was set receives the same as a sonar of the scene") {
  Scene scene = bare_scene();
  Simulator session(scene);
  session.ping_numbered(beside, 0);
  Sonar& sonar = scene.sonars.front();
  sonar.range_m = 18.0;
  sonar.frequency_hz = 300e3;
  sonar.bins = 90;
  sonar.sides = Sides::starboard;
  session.set_sonar(0, sonar);
  Simulator other(scene);
  CHECK(numbers(session.ping_numbered(beside, 3)) == numbers(other.ping_numbered(beside, 3)));
  CHECK(session.sonars().front().bins == 90);
}

TEST_CASE("invalid calls are refused and change nothing") {
  Simulator session(bare_scene());
  const std::vector<double> before = numbers(session.ping_numbered(beside, 0));
  const auto nowhere = Pose{.position = {0.0, infinity, 0.0}};
  CHECK_THROWS_AS(session.ping_numbered(nowhere, 0), std::invalid_argument);
  CHECK_THROWS_AS(session.ping({.t_s = infinity, .position = beside.position}),
                  std::invalid_argument);
  CHECK_THROWS_AS(session.add({.mesh = cube(1.0f)}, nowhere), std::invalid_argument);
  CHECK_THROWS_AS(session.add({}, beside), std::invalid_argument);
  CHECK_THROWS_AS(session.add({.mesh = cube(1.0f), .class_name = "none"}, beside),
                  std::invalid_argument);
  CHECK_THROWS_AS(session.add({.mesh = cube(1.0f), .class_name = ""}, beside),
                  std::invalid_argument);
  CHECK_THROWS_AS(session.add({.mesh = cube(1.0f), .material = "cheese"}, beside),
                  std::invalid_argument);
  refine::TriangleMesh broken = cube(1.0f);
  broken.faces.front()[1] = 99;
  CHECK_THROWS_AS(session.add({.mesh = broken, .material = "wood"}, beside), refine::MeshError);
  CHECK_THROWS_AS(session.move(1, beside), std::invalid_argument);
  CHECK_THROWS_AS(session.remove(0), std::invalid_argument);
  Sonar deaf = session.sonars().front();
  for (const double range_m : {std::nan(""), -1.0, infinity}) {
    deaf.range_m = range_m;
    CHECK_THROWS_AS(session.set_sonar(0, deaf), SceneError);
  }
  CHECK_THROWS_AS(session.set_sonar(1, Sonar{}), std::invalid_argument);
  for (const std::string name : {"", "../outside", "a b", "manifest"}) {
    Sonar named = session.sonars()[0];
    named.name = name;
    CHECK_THROWS_AS(session.set_sonar(0, named), SceneError);
  }
  CHECK(session.materials().size() == 2);
  CHECK(numbers(session.ping_numbered(beside, 0)) == before);
}

TEST_CASE("a ping does not depend on earlier pings, even if these were near the bed") {
  Simulator session(bare_scene());
  const double bed_m = -session.altitude_m({0.3, 0.2, 0.0});
  const auto heard = [&](double z_m) {
    return numbers(session.ping_numbered({.position = {0.3, 0.2, z_m}}, 0));
  };
  const std::vector<double> first = heard(-7.0);
  for (const double z_m : {-1e-6, bed_m + 1e-6, bed_m + 0.5, bed_m + 2.0}) {
    heard(z_m);
    CHECK((heard(-7.0) == first));
  }
}

TEST_CASE("eight threads, each with a simulator, receive the same as one thread") {
  const Scene scene = bare_scene();
  const auto session = [&] {
    Simulator simulator(scene);
    std::vector<double> all;
    const std::uint32_t instance = simulator.add({.mesh = cube(1.0f)}, beside);
    for (int ping = 0; ping < 6; ++ping) {
      simulator.move(instance, {.position = {8.0 + ping, 0.0, -12.0}});
      Pose pose = beside;
      pose.t_s = 0.2 * ping;
      const std::vector<double> line = numbers(simulator.ping(pose));
      all.insert(all.end(), line.begin(), line.end());
    }
    return all;
  };
  const std::vector<double> expected = session();
  std::vector<std::vector<double>> heard(8);
  std::vector<std::thread> threads;
  for (std::vector<double>& mine : heard) threads.emplace_back([&] { mine = session(); });
  for (std::thread& thread : threads) thread.join();
  for (const std::vector<double>& mine : heard) CHECK(mine == expected);
}

TEST_CASE("an object of the scene that moves is received as one that a session moves") {
  const TemporaryFolder folder;
  write_text(folder / "way.csv",
             "t_s,east_m,north_m,heading_deg,z_m,roll_deg\n1,6,0,350,-13,0\n3,8,1,10,-12,20\n");
  const auto [by_file, surface] =
      GENERATE(std::pair(false, "static"), std::pair(true, "static"), std::pair(false, "refined"),
               std::pair(true, "footprint"));
  {
    CAPTURE(by_file, surface);
    Scene moving = bare_scene();
    moving.run.surface = surface;
    ObjectOptions& box = moving.objects.emplace_back();
    box.shape = "box";
    box.size = {.length_m = 1.0, .width_m = 2.0, .shape_height_m = 1.5};
    box.class_name = "crate";
    box.east_m = 6.0;
    box.height_m = 0.5;
    if (by_file)
      box.poses = InputFile{"way.csv", folder / "way.csv"};
    else {
      box.path = {{2.0, 0.0}, {2.0, 3.0}};
      box.speed_mps = 1.5;
    }
    Simulator scene(moving);
    REQUIRE(scene.seafloor().moving.size() == 1);
    const MovingRecord& record = scene.seafloor().moving[0];
    Scene bare = moving;
    bare.objects.clear();
    Simulator session(bare);
    const std::uint32_t instance = session.add(
        {.mesh = record.mesh, .material = moving.objects[0].material, .class_name = "crate"},
        beside);
    CHECK(instance == 1);
    const double start_m = record.record.middle_m.z();
    for (const double t_s : {0.0, 1.0, 2.0, 2.5, 3.0, 60.0}) {
      Pose object;
      if (by_file) {
        const double share = std::clamp((t_s - 1.0) / 2.0, 0.0, 1.0);
        object = {.position = {6.0 + 2.0 * share, share, -13.0 + share},
                  .roll_rad = 20.0 * degree * share,
                  .heading_rad = (-10.0 + 20.0 * share) * degree};
      } else {
        const double gone_m = std::min(5.0, 1.5 * t_s);
        object = {.position = {6.0 + std::min(gone_m, 2.0), std::max(0.0, gone_m - 2.0), start_m},
                  .heading_rad = gone_m < 2.0 ? 90.0 * degree : 0.0};
      }
      session.move(instance, object);
      Pose pose = beside;
      pose.t_s = t_s;
      CAPTURE(t_s);
      const std::vector<double> by_scene = numbers(scene.ping_numbered(pose, 7)),
                                by_hand = numbers(session.ping_numbered(pose, 7));
      REQUIRE(by_scene.size() == by_hand.size());
      double most = 0.0;
      for (std::size_t i = 0; i < by_scene.size(); ++i)
        most = std::max(most, std::abs(by_scene[i] - by_hand[i]) / (1e-6 + std::abs(by_hand[i])));
      CHECK(most < 1e-3);
    }
  }
}
