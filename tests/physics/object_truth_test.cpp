#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <map>
#include <numbers>

#include <Eigen/Geometry>

#include "support/catch.h"
#include "support/data.h"

#include <ensonify/engine/image/truth.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/sonar/ping.h>
#include <ensonify/engine/trace/intersector.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;

namespace {

constexpr double altitude_m = 8.0, ping_step_m = 0.1;

/// A level bed 20 m down, under a line to the north along x = 0.
Scene level_scene(std::vector<ObjectOptions> objects) {
  Scene scene;
  scene.speckle = false;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 80.0;
  scene.seafloor.cell_m = 0.5;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.objects = std::move(objects);
  scene.track.pings = 120;
  scene.track.speed_mps = 1.0;
  scene.track.ping_interval_s = ping_step_m;
  scene.track.altitude_m = altitude_m;
  scene.run.surface = "static";  // the mesh is looked at
  scene.sonars[0].range_m = 32.0;
  scene.sonars[0].bins = 640;
  scene.sonars[0].elevations = 3000;
  scene.sea.sound_speed_mps = 1500.0;
  return scene;
}

ObjectOptions thing(const char* shape, double east_m, double north_m) {
  ObjectOptions object;
  object.shape = shape;
  object.east_m = east_m;
  object.north_m = north_m;
  return object;
}

struct Image {
  Simulator simulator;
  Waterfall waterfall;
  explicit Image(const Scene& scene)
      : simulator(scene), waterfall(scene.sonars[0], static_cast<std::size_t>(scene.track.pings)) {
    const std::vector<Pose> poses = simulator.track();
    for (std::size_t i = 0; i < poses.size(); ++i)
      waterfall.set_row(i, simulator.ping(poses[i], i), {.pose = poses[i]});
  }
};

double distance_m(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const auto to_edge = [&](const Vector3d& from, const Vector3d& to) {
    const Vector3d way = to - from;
    const double along = std::clamp((p - from).dot(way) / way.squaredNorm(), 0.0, 1.0);
    return (p - from - along * way).norm();
  };
  const Vector3d normal = (b - a).cross(c - a).normalized();
  const bool above = (b - a).cross(p - a).dot(normal) >= 0.0 &&
                     (c - b).cross(p - b).dot(normal) >= 0.0 &&
                     (a - c).cross(p - c).dot(normal) >= 0.0;
  return above ? std::abs(normal.dot(p - a))
               : std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
}

/// To the faces of one object.
double distance_m(const Vector3d& p, const Seafloor& seafloor, std::uint32_t instance) {
  const refine::Triangles all = seafloor.mesh;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t f = seafloor.bed_faces; f < all.faces.size(); ++f) {
    const auto face = static_cast<std::uint32_t>(f);
    if (seafloor.labels[seafloor.label_of(face)].instance == instance)
      least = std::min(
          least, distance_m(p, all.corner(face, 0), all.corner(face, 1), all.corner(face, 2)));
  }
  return least;
}

std::vector<ObjectOptions> four_things() {
  std::vector<ObjectOptions> objects = {thing("cylinder", 14.0, 1.0), thing("cone", -12.0, -2.0),
                                        thing("box", 20.0, -3.0), thing("sphere", -18.0, 3.0)};
  objects[0].heading_rad = 0.5;
  objects[3].height_m = 0.7;
  return objects;
}

/// Bins of a region and an instance in one side of one ping, nearest and farthest; none: {n, 0}.
std::pair<std::size_t, std::size_t> run_of(const EchoLine& line, Region region,
                                           std::uint32_t instance) {
  std::size_t first = line.bins.region.size(), last = 0;
  for (std::size_t i = 0; i < line.bins.region.size(); ++i)
    if (line.bins.region[i] == static_cast<std::uint32_t>(region) &&
        (region == Region::object ? line.bins.instance : line.bins.shadow_instance)[i] ==
            instance) {
      first = std::min(first, i);
      last = i;
    }
  return {first, last};
}

}  // namespace

TEST_CASE("Every labelled pixel lies on its object, but for what else its bin saw") {
  Image image(level_scene(four_things()));
  const Layers& pixels = image.waterfall.pixels;
  std::map<std::uint32_t, int> seen;
  for (std::size_t i = 0; i < pixels.region.size(); ++i) {
    if (pixels.region[i] != static_cast<std::uint32_t>(Region::object)) continue;
    const Vector3d place(pixels.x_m[i], pixels.y_m[i], pixels.z_m[i]);
    const double off_m = distance_m(place, image.simulator.seafloor(), pixels.instance[i]);
    CAPTURE(pixels.instance[i], pixels.fraction[i], place.transpose());
    // A bin and the beam's width are averaged over; the rest of the energy comes from the bed at the
    // same range, two metres away at most.
    REQUIRE(off_m < 0.12 + 2.0 * (1.0 - pixels.fraction[i]));
    ++seen[pixels.instance[i]];
  }
  for (std::uint32_t instance = 1; instance <= 4; ++instance) CHECK(seen[instance] > 50);
}

TEST_CASE(
    "An object's shadow begins behind what is last seen of it and ends where the line over its top "
    "meets the bed") {
  std::vector<ObjectOptions> objects = {thing("cylinder", 14.0, 0.0), thing("cone", -12.0, 0.0)};
  objects[0].size.diameter_m = 1.0;
  objects[1].size.diameter_m = 1.2;
  objects[1].size.top_diameter_m = 1.2;
  objects[1].size.tall_m = 1.5;
  const Scene scene = level_scene(objects);
  Simulator simulator(scene);
  const std::vector<Pose> poses = simulator.track();
  const std::span<const EchoLine> lines = simulator.ping(poses[60], 60);
  const double bin_m = scene.sonars[0].bin_m();
  const auto check_shadow = [&](const EchoLine& line, std::uint32_t instance, double from_m,
                                double end_m) {
    const auto [first, last] = run_of(line, Region::shadow, instance);
    CAPTURE(instance);
    REQUIRE(last > first);
    CHECK(first > run_of(line, Region::object, instance).first);
    CHECK(std::abs(double(first) * bin_m - from_m) <= 2.5 * bin_m);
    CHECK(std::abs(double(last + 1) * bin_m - std::hypot(altitude_m, end_m)) <= 2.5 * bin_m);
  };
  // The foot is last seen, under the round side. The line over the top touches a circle of radius r
  // whose middle lies r over the bed at ground range x.
  const double r = 0.5, x = 14.0;
  const double depression =
      std::atan2(altitude_m - r, x) - std::asin(r / std::hypot(x, altitude_m - r));
  check_shadow(lines[1], 1, std::hypot(altitude_m, x), altitude_m / std::tan(depression));
  // X h / (h - t) of the far edge of the top, which itself is the last to be seen.
  check_shadow(lines[0], 2, std::hypot(altitude_m - 1.5, 12.0 + 0.6),
               (12.0 + 0.6) * altitude_m / (altitude_m - 1.5));
}

TEST_CASE("Static and refined surfaces give every object the same pixels") {
  Scene scene = level_scene(four_things());
  scene.track.pings = 60;
  const auto areas = [&](const char* surface) {
    scene.run.surface = surface;
    std::vector<std::size_t> found;
    for (const Target& target : find_targets(Image(scene).waterfall))
      found.insert(found.end(), {target.body.area_px, target.shadow.area_px});
    return found;
  };
  const std::vector<std::size_t> of_static = areas("static");
  CHECK(of_static.size() == 8);
  CHECK(areas("refined") == of_static);
}

TEST_CASE("What is buried is not seen, and what is not is, each once") {
  std::vector<ObjectOptions> objects = four_things();
  for (const std::size_t buried : {1, 2}) objects[buried].burial = 1.0;
  objects.push_back(thing("boulder", 10.0, 3.0));
  std::vector<std::uint32_t> seen;
  for (const Target& target : find_targets(Image(level_scene(objects)).waterfall)) {
    seen.push_back(target.instance);
    CHECK(target.body.area_px > 0);
    CHECK(target.shadow.area_px > 0);
  }
  CHECK(seen == std::vector<std::uint32_t>{1, 4, 5});
}

TEST_CASE("Half sunk in, an object's shadow is that of the half that stands out") {
  std::vector<ObjectOptions> objects = {thing("box", 16.0, 0.0), thing("box", -16.0, 0.0)};
  for (ObjectOptions& box : objects) box.size.tall_m = 2.0;
  objects[1].burial = 0.5;
  Simulator simulator(level_scene(objects));
  const std::span<const EchoLine> lines = simulator.ping(simulator.track()[60], 60);
  const auto end_m = [&](std::size_t side, std::uint32_t instance) {
    const double slant_m = double(run_of(lines[side], Region::shadow, instance).second + 1) * 0.05;
    return std::sqrt(slant_m * slant_m - altitude_m * altitude_m);
  };
  CHECK(end_m(1, 1) == Approx(16.5 * 8.0 / 6.0).margin(0.15));
  CHECK(end_m(0, 2) == Approx(16.5 * 8.0 / 7.0).margin(0.15));
}

TEST_CASE("A target's box lies where its object is, as large as object and beam") {
  Image image(level_scene(four_things()));
  const std::vector<Target> targets = find_targets(image.waterfall);
  REQUIRE(targets.size() == 4);
  const double bin_m = image.waterfall.sonar.bin_m();
  for (const Target& target : targets) {
    CAPTURE(target.instance);
    const ObjectRecord& object = image.simulator.seafloor().objects[target.instance - 1];
    // Pings count northwards from y = -6 m, and rows from the newest.
    const double row = 119.0 - (object.middle_m.y() + 5.95) / ping_step_m;
    CHECK(0.5 * (target.body.low[1] + target.body.high[1] - 1) == Approx(row).margin(2.0));
    const double tall = target.body.high[1] - target.body.low[1];
    CHECK(tall * ping_step_m >= 0.9 * object.size_m.y() - ping_step_m);
    CHECK(tall * ping_step_m <= object.size_m.y() + 0.6);
    const bool port = object.middle_m.x() < 0.0;
    CHECK(target.side == (port ? Side::port : Side::starboard));
    const double range_m = std::hypot(object.middle_m.x(), object.middle_m.z() + 20.0 - altitude_m);
    CHECK(target.range_m == Approx(range_m).margin(0.6 * object.size_m.x() + 2.0 * bin_m));
    // The shadow follows the body, away from the sonar.
    CHECK((port ? target.shadow.low[0] < target.body.low[0]
                : target.shadow.high[0] > target.body.high[0]));
  }
}

TEST_CASE("Labels cost a ping over the wreck a quarter at most", "[slow]") {
  const auto file = tests::data_file("mesh_underwater/skytteren_wreck.ply");
  if (!file) {
    WARN("no data folder: skipped");
    return;
  }
  Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 300.0;
  scene.seafloor.cell_m = 0.5;
  scene.seafloor.depth_m = 90.0;
  scene.objects.push_back({.mesh = {"wreck.ply", *file}, .north_m = 60.0});
  Seafloor labelled = make_seafloor(scene.seafloor, 1, scene.objects);
  Seafloor bare = labelled;  // one label, which answers from both sides as the wreck does
  bare.face_label.clear();
  bare.labels.resize(1);
  bare.labels[0].two_sided = true;
  Sonar sonar;
  sonar.range_m = 180.0;
  sonar.bins = 1800;
  const auto tracer = make_intersector("embree", labelled.mesh);
  const std::vector<scatter::BackscatterTable> lambert(
      3, scatter::BackscatterTable(scatter::Lambert(-27.0)));
  Pinger with(sonar, 0, {}, labelled, lambert), without(sonar, 0, {}, bare, lambert);
  Pose pose{.position = {0.0, -20.0, -45.0}};
  pose.heading_rad = 0.5 * std::numbers::pi;
  EchoLine line;
  line.bins.assign(1800);
  const auto cpu_s = [] {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
  };
  const auto one = [&](Pinger& pinger) {
    const double start_s = cpu_s();
    pinger.aim(pose, 45.0);
    for (const Side side : {Side::port, Side::starboard}) {
      pinger.trace(*tracer, labelled.mesh, side);
      pinger.echo(labelled.mesh, side, line);
    }
    return cpu_s() - start_s;
  };
  double best_with_s = 1e9, best_without_s = 1e9;
  for (int round = 0; round < 30; ++round) {
    best_with_s = std::min(best_with_s, one(with));
    best_without_s = std::min(best_without_s, one(without));
  }
  WARN("a ping takes " << 1e3 * best_with_s << " ms with labels, " << 1e3 * best_without_s
                       << " ms without");
  CHECK(best_with_s <= 1.25 * best_without_s);
}
