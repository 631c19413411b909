// Sessions of a Simulator: pings at given times, changed settings, objects that are added, moved
// and removed.

#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/simulator/session_objects.h>
#include <ensonify/engine/trace/face_sources/static_faces.h>

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
#include "support/temporary_folder.h"

#include <ensonify/refine/mesh_reader.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Scene bare_scene() {
  Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 50.0;
  scene.seafloor.cell_m = 0.5;
  scene.seafloor.depth_m = 15.0;
  scene.sonars.front().range_m = 25.0;
  scene.sonars.front().bins = 200;
  scene.sonars.front().elevations = 400;
  scene.run.surface = "static";
  return scene;
}

/// The same, where sound is faster near the bed.
Scene bent_scene(const tests::TemporaryFolder& folder) {
  tests::write_text(folder / "cast.csv",
                    "depth_m,soundspeed_mps\n0,1504\n4,1505\n18,1510\n33,1511\n");
  Scene scene = bare_scene();
  scene.sea.profile = {"cast.csv", folder / "cast.csv"};
  scene.sea.refraction = RefractionMode::full;
  return scene;
}

Scene with_box(Scene scene, const tests::TemporaryFolder& folder) {
  Seafloor holder;
  tests::add_box(holder, {0, 0, 0}, {4, 2, 3});
  refine::write_ply(folder / "box.ply", holder.mesh);
  scene.objects.push_back({.mesh = {"box.ply", folder / "box.ply"},
                           .class_name = "box",
                           .material = "wood",
                           .east_m = 12.0,
                           .north_m = 0.0,
                           .heading_rad = 0.4});
  return scene;
}

/// The one object of a scene, in local metres.
refine::TriangleMesh object_of(const Simulator& simulator) {
  const refine::TriangleMesh& all = simulator.seafloor().mesh;
  refine::TriangleMesh mesh{.positions = all.positions};
  mesh.faces.assign(all.faces.begin() + static_cast<std::ptrdiff_t>(simulator.seafloor().bed_faces),
                    all.faces.end());
  return mesh;
}

const Pose beside{.position = {0.0, 0.0, -7.0}, .roll_rad = 0.02, .heading_rad = 0.1};

/// Every number of every line.
std::vector<double> numbers(std::span<const EchoLine> lines) {
  std::vector<double> all;
  for (const EchoLine& line : lines)
    BinLayers::for_each([&](std::string_view, auto layer) {
      all.insert(all.end(), (line.bins.*layer).begin(), (line.bins.*layer).end());
    });
  return all;
}

std::size_t bins_of(std::span<const EchoLine> lines, std::uint32_t instance) {
  std::size_t count = 0;
  for (const EchoLine& line : lines) count += std::ranges::count(line.bins.instance, instance);
  return count;
}

refine::TriangleMesh cube(float half_m) {
  Seafloor holder;
  tests::add_box(holder, {-half_m, -half_m, -half_m}, {half_m, half_m, half_m});
  return holder.mesh;
}

}  // namespace

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
          CHECK(line.side == (east_m > 0 ? Side::starboard : Side::port));
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
  CHECK_THAT(session.warnings().back(),
             Catch::Contains("5000.0 m east, 0.0 m north is 4975.0 m off the seafloor"));
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

TEST_CASE("an object that cannot be moved is answered with those that can be") {
  const tests::TemporaryFolder folder;
  Simulator session(with_box(bare_scene(), folder));
  CHECK_THROWS_WITH(session.move(1, beside),
                    Catch::Contains("instance 1, which belongs to the scene") &&
                        Catch::Contains("add an object first"));
  const std::uint32_t added = session.add({.mesh = cube(1.0f), .material = "wood"}, beside);
  CHECK_THROWS_WITH(session.remove(9), Catch::EndsWith("are " + std::to_string(added)));
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
