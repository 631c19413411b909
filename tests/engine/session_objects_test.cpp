// Objects that a session adds, moves and removes.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
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

TEST_CASE("an object that is added gives the same numbers as one of the scene") {
  const tests::TemporaryFolder folder;
  Scene scene = bare_scene();
  for (const auto& [surface, intersector] :
       {std::pair{"static", "embree"}, {"refined", "embree"}, {"footprint", "fan_scan"}}) {
    CAPTURE(surface, intersector);
    scene.run.intersector = intersector;
    scene.run.surface = "static";
    Simulator of_scene(with_box(scene, folder));
    scene.run.surface = surface;
    Simulator session(scene);
    const std::vector<double> empty = numbers(session.ping_numbered(beside, 0));
    const std::vector<double> expected = numbers(of_scene.ping_numbered(beside, 0));
    REQUIRE(empty != expected);

    const std::uint32_t instance =
        session.add({.mesh = object_of(of_scene), .material = "wood", .class_name = "box"}, {});
    CHECK(instance == 1);
    CHECK(session.classes().back() == "box");
    CHECK(session.materials().back() == "wood");
    CHECK(numbers(session.ping_numbered(beside, 0)) == expected);
    CHECK(numbers(session.ping_numbered(beside, 0)) == expected);  // the tree is still valid

    session.remove(instance);
    CHECK(numbers(session.ping_numbered(beside, 0)) == empty);
  }
}

TEST_CASE("after an object is removed, the bed echoes as before, wherever the sonar is") {
  Scene scene = bare_scene();
  scene.seafloor.depth_m = 6.0;
  Simulator session(scene);
  for (const double across_m : {-12.0, -6.0, 0.0, 6.0, 12.0}) {
    CAPTURE(across_m);
    const Pose pose{.position = {across_m, 0.0, -1.0}};  // the middle of the world is in its beam
    const std::vector<double> before = numbers(session.ping_numbered(pose, 0));
    session.remove(session.add({.mesh = cube(1.0f)}, {.position = {10, 0, -5}}));
    CHECK(numbers(session.ping_numbered(pose, 0)) == before);
  }
}

TEST_CASE("removing one of several objects leaves the lines of those that stay") {
  for (const char* surface : {"static", "refined", "footprint"})
    for (const bool first : {true, false}) {
      CAPTURE(surface, first);
      Scene scene = bare_scene();
      scene.run.surface = surface;
      const Pose port{.position = {-10, 0, -14}}, starboard{.position = {10, 0, -14}};
      const MovingObject object{.mesh = cube(1.0f)};
      Simulator session(scene), fresh(scene);
      const std::uint32_t one = session.add(object, port), other = session.add(object, starboard);
      session.ping_numbered(beside, 0);
      session.remove(first ? one : other);
      const std::uint32_t stays = fresh.add(object, first ? starboard : port);
      // The other one has its own instance, and is where it was.
      const std::span<const EchoLine> lines = session.ping_numbered(beside, 0);
      CHECK(bins_of(lines, first ? one : other) == 0);
      CHECK(bins_of(lines, first ? other : one) > 0);
      if (first) continue;
      CHECK(stays == one);
      CHECK(numbers(lines) == numbers(fresh.ping_numbered(beside, 0)));
    }
}

TEST_CASE("an added box echoes as the box of a scene does, without an echo from its inside") {
  const tests::TemporaryFolder folder;
  Scene scene = bare_scene();
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.seafloor.depth_m = 20.0;
  scene.sonars.front().range_m = 30.0;
  scene.sonars.front().bins = 1200;
  scene.sonars.front().elevations = 2048;
  scene.speckle = scene.texture = false;
  Scene with = scene;
  with.objects.push_back({.shape = "box",
                          .size = {.length_m = 2.0, .width_m = 2.0},
                          .material = "steel",
                          .east_m = 15.0,
                          .north_m = 0.0});
  Simulator of_scene(with), session(scene);
  const refine::TriangleMesh box = object_of(of_scene);
  session.add({.mesh = box, .material = "steel", .class_name = "object"}, {});
  const Pose abeam{.position = {0.0, 0.0, -10.0}};
  const EchoLine expected = of_scene.ping_numbered(abeam, 0)[1];
  const EchoLine& line = session.ping_numbered(abeam, 0)[1];
  REQUIRE(std::ranges::count(expected.bins.instance, 1u) > 0);
  for (std::size_t i = 0; i < line.bins.region.size(); ++i)
    if (line.bins.region[i] == static_cast<std::uint32_t>(Region::shadow)) {
      CAPTURE(i);
      CHECK(line.bins.intensity_mean[i] <= 1.01f * expected.bins.intensity_mean[i] + 1e-6f);
    }

  // Inside out and without common vertices, its inner sides still are its inner sides.
  refine::TriangleMesh loose;
  for (const refine::Face& face : box.faces) {
    const auto first = static_cast<std::uint32_t>(loose.positions.size());
    for (const std::uint32_t vertex : face) loose.positions.push_back(box.positions[vertex]);
    loose.faces.push_back({first, first + 2, first + 1});
  }
  Simulator with_loose(scene);
  with_loose.add({.mesh = loose, .material = "steel", .class_name = "object"}, {});
  // Past both ends of the box, where its edges end next to rays that pass it.
  for (int i = -26; i <= 26; ++i) {
    const double north_m = 0.05 * i;
    CAPTURE(north_m);
    const Pose pose{.position = {0.0, north_m, -10.0}};
    const std::vector<double> of_box = numbers(of_scene.ping_numbered(pose, 0));
    CHECK(numbers(session.ping_numbered(pose, 0)) == of_box);
    CHECK(numbers(with_loose.ping_numbered(pose, 0)) == of_box);
  }
}

TEST_CASE("bent rays meet an added object as one of the scene, at any height") {
  const tests::TemporaryFolder folder;
  Scene scene = bent_scene(folder);
  scene.sonars.front().sector_high_rad = 0.5 * std::numbers::pi;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.seafloor.depth_m = 20.0;
  scene.sonars.front().range_m = 30.0;
  scene.sonars.front().bins = 1200;
  scene.sonars.front().elevations = 2048;
  scene.speckle = scene.texture = false;
  for (const double height_m : {0.0, 3.0, 5.0, 8.0}) {
    CAPTURE(height_m);
    Scene with = scene;
    with.objects.push_back({.shape = "box",
                            .size = {.length_m = 2.0, .width_m = 2.0},
                            .material = "steel",
                            .east_m = 15.0,
                            .north_m = 0.0,
                            .height_m = height_m});
    Simulator of_scene(with), session(scene);
    const std::uint32_t added =
        session.add({.mesh = object_of(of_scene), .material = "steel", .class_name = "ball"}, {});
    const Pose pose{.position = {0.0, 0.0, -10.0}};
    const auto bins = [&](Simulator& simulator) {
      std::size_t body = 0, shadow = 0;
      for (const EchoLine& line : simulator.ping_numbered(pose, 0))
        for (std::size_t i = 0; i < line.bins.region.size(); ++i) {
          body += line.bins.instance[i] == added;
          shadow += line.bins.shadow_instance[i] == added;
        }
      return std::pair(body, shadow);
    };
    const auto expected = bins(of_scene), found = bins(session);
    REQUIRE(expected.first + expected.second > 0);
    CHECK(double(found.first) == Approx(double(expected.first)).margin(2.0));
    CHECK(double(found.second) == Approx(double(expected.second)).margin(2.0));
    session.remove(added);
    CHECK(numbers(session.ping_numbered(pose, 0)) ==
          numbers(Simulator(scene).ping_numbered(pose, 0)));
  }
}

TEST_CASE("a plate of kilometres is met by bent rays without memory for all of it") {
  const tests::TemporaryFolder folder;
  Scene scene = bent_scene(folder);
  scene.sonars.front().elevations = 40;
  Simulator session(scene);
  const float half_m = 50e3f;
  const refine::TriangleMesh plate{.positions = {{-half_m, -half_m, 0},
                                                 {half_m, -half_m, 0},
                                                 {half_m, half_m, 0},
                                                 {-half_m, half_m, 0}},
                                   .faces = {{0, 1, 2}, {0, 2, 3}}};
  const std::uint32_t added = session.add({.mesh = plate}, {.position = {0, 0, -12}});
  CHECK(bins_of(session.ping_numbered({.position = {0, 0, -7}}, 0), added) > 0);
}

TEST_CASE("an object is seen where it was moved to") {
  Simulator session(bare_scene());
  const std::uint32_t cube_of_2m = session.add({.mesh = cube(1.0f)}, {.position = {10, 0, -13}});
  const std::uint32_t far_away = session.add({.mesh = cube(1.0f)}, {.position = {10, 500, -13}});
  REQUIRE(far_away == cube_of_2m + 1);
  const Pose level{.position = {0, 0, -7}};
  for (const double east_m : {10.0, -12.0, 15.0}) {
    session.move(cube_of_2m, {.position = {east_m, 0, -13}, .heading_rad = 0.7});
    const std::span<const EchoLine> lines = session.ping_numbered(level, 0);
    CHECK(bins_of(lines, cube_of_2m) > 0);
    CHECK(bins_of(lines, far_away) == 0);
    for (const EchoLine& line : lines)
      for (std::size_t bin = 0; bin < line.bins.instance.size(); ++bin)
        if (line.bins.instance[bin] == cube_of_2m && line.bins.fraction[bin] > 0.99f) {
          CHECK(line.sector == (east_m > 0 ? 1u : 0u));
          CHECK(std::abs(line.bins.x_m[bin] - east_m) < 1.5);
          CHECK(std::abs(line.bins.y_m[bin]) < 1.5);
        }
  }
  session.move(cube_of_2m, {.position = {0, 30, -13}});
  CHECK(bins_of(session.ping_numbered(level, 0), cube_of_2m) == 0);
}

TEST_CASE("bent rays follow the last of several changes of the objects") {
  const tests::TemporaryFolder folder;
  const Scene scene = bent_scene(folder);
  Simulator session(scene), fresh(scene);
  const MovingObject object{.mesh = cube(1.0f)};
  const std::uint32_t added = session.add(object, {.position = {10, 0, -100}});
  session.move(added, {.position = {10, 0, -400}});
  const std::uint32_t other = session.add(object, {.position = {10, 0, -900}});
  session.ping_numbered(beside, 0);
  session.remove(other);
  session.move(added, {.position = {10, 0, -12}});
  const std::vector<double> heard = numbers(session.ping_numbered(beside, 0));
  fresh.add(object, {.position = {10, 0, -12}});
  CHECK(heard == numbers(fresh.ping_numbered(beside, 0)));
}

TEST_CASE("an object under the bed is hidden by it") {
  Simulator session(bare_scene());
  const std::vector<double> before = numbers(session.ping_numbered(beside, 0));
  session.add({.mesh = cube(1.0f)}, {.position = {10, 0, -22}});
  CHECK(numbers(session.ping_numbered(beside, 0)) == before);
}

TEST_CASE("the y axis of an object points along its heading, its z axis up") {
  // A box 4 m ahead of the place, 3 m over it, nearer than the bed.
  Seafloor holder;
  tests::add_box(holder, {-0.5f, 3.5f, 2.5f}, {0.5f, 4.5f, 3.5f});
  Simulator session(bare_scene());
  session.add({.mesh = holder.mesh},
              {.position = {2, 0, -11.5}, .heading_rad = 1.5707963267948966});
  const std::span<const EchoLine> lines = session.ping_numbered({.position = {0, 0, -7}}, 0);
  std::size_t seen = 0;
  for (std::size_t bin = 0; bin < lines[1].bins.instance.size(); ++bin)
    if (lines[1].bins.instance[bin] == 1 && lines[1].bins.fraction[bin] > 0.99f) {
      ++seen;
      CHECK(std::abs(lines[1].bins.x_m[bin] - 6.0f) <= 0.51f);
      CHECK(std::abs(lines[1].bins.z_m[bin] + 8.5f) <= 0.51f);
    }
  CHECK(seen > 0);
}

TEST_CASE("an add() that the stop check ends changes nothing") {
  struct Stop {};
  bool stop = false;
  Simulator session(bare_scene(), {.stop_check = [&] {
                      if (stop) throw Stop();
                    }});
  const std::vector<double> before = numbers(session.ping_numbered(beside, 0));
  stop = true;
  CHECK_THROWS_AS(session.add({.mesh = cube(1.0f), .material = "wood"}, beside), Stop);
  stop = false;
  CHECK(session.next_instance() == 1);
  CHECK(numbers(session.ping_numbered(beside, 0)) == before);
}

TEST_CASE("an object lies where every intersector takes it, or is refused") {
  Scene scene = bare_scene();
  scene.sonars.front().elevations = 100;
  for (const auto& [surface, intersector] : {std::pair{"static", "embree"},
                                             {"static", "pluecker"},
                                             {"refined", "embree"},
                                             {"footprint", "fan_scan"}}) {
    CAPTURE(surface, intersector);
    scene.run.surface = surface;
    scene.run.intersector = intersector;
    Simulator session(scene);
    const auto at = [](double x_m) { return Pose{.position = {x_m, 0, -13}}; };
    CHECK_NOTHROW(session.add({.mesh = cube(9e7f)}, {.position = {1e8, -1e8, -1e8}}));
    const std::uint32_t small = session.add({.mesh = cube(1.0f)}, at(10));
    const std::vector<double> before = numbers(session.ping_numbered(beside, 0));
    for (const double x_m : {1.1e8, -1e10, 1e30, 1e300}) {
      CHECK_THROWS_WITH(session.add({.mesh = cube(1.0f)}, at(x_m)), Catch::Contains("1e+08 m"));
      CHECK_THROWS_WITH(session.move(small, at(x_m)), Catch::Contains("1e+08 m"));
      CHECK_THROWS_WITH(session.ping(at(x_m)), Catch::Contains("1e+08 m"));
    }
    const std::size_t warnings = session.warnings().size();
    for (const float half_m : {1.1e8f, 1e30f})
      CHECK_THROWS_AS(session.add({.mesh = cube(half_m), .material = "wood"}, at(10)),
                      refine::MeshError);
    CHECK(session.warnings().size() == warnings);
    CHECK(numbers(session.ping_numbered(beside, 0)) == before);
    session.move(small, at(1e8));
    CHECK_NOTHROW(session.ping(beside));
    CHECK_NOTHROW(session.ping({.position = {1e8, 1e8, -7}}));
  }
}

TEST_CASE("there are as many class names as a label can number") {
  Seafloor seafloor;
  seafloor.classes = {""};
  for (std::size_t i = 1; i < max_labels; ++i) seafloor.classes.push_back(std::to_string(i));
  seafloor.materials = {"", "wood"};
  const FaceSourceParts parts{.intersector = "embree"};
  FacesWithBodies faces(make_static_faces(parts), 0, parts);
  SessionObjects objects(seafloor, faces);
  const auto add = [&](const std::string& class_name) {
    objects.add({.mesh = cube(1.0f), .material = "wood", .class_name = class_name}, beside);
    return objects.labels().back().class_id;
  };
  CHECK(add("last") == max_labels);
  CHECK_THROWS_WITH(add("one more"), Catch::Contains("'one more' is a new class"));
  CHECK(add("7") == 7);
  CHECK(add("last") == max_labels);
  CHECK(objects.classes().size() == max_labels + 1);
}

TEST_CASE("an object that cannot be moved is answered with those that can be") {
  const tests::TemporaryFolder folder;
  Simulator session(with_box(bare_scene(), folder));
  CHECK_THROWS_WITH(session.move(1, beside),
                    Catch::Contains("instance 1, which belongs to the scene") &&
                        Catch::Contains("add an object first"));
  const std::uint32_t added = session.add({.mesh = cube(1.0f), .material = "wood"}, beside);
  CHECK_THROWS_WITH(session.remove(9), Catch::EndsWith("are " + std::to_string(added)));
}
