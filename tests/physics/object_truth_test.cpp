#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include <Eigen/Geometry>

#include "support/catch.h"

#include <ensonify/engine/dataset/labelled_image.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/image/truth.h>
#include <ensonify/engine/image/waterfall.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/trace/intersector.h>

using namespace ensonify;
using namespace ensonify::engine;
using Eigen::Vector3d;

namespace {

constexpr double over_bed_m = 8.0, ping_step_m = 0.1;

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
  scene.track.altitude_m = over_bed_m;
  scene.run.surface = "static";  // the tests read the mesh
  scene.sonars[0].range_m = 32.0;
  scene.sonars[0].bins = 640;
  scene.sonars[0].elevations = 3000;
  scene.sea.sound_speed_mps = 1500.0;
  return scene;
}

/// level_scene() with a bed of 50 x 20 m, finer cells and other rays.
Scene fine_scene(std::vector<ObjectOptions> objects, double cell_m) {
  Scene scene = level_scene(std::move(objects));
  scene.seafloor.cell_m = cell_m;
  scene.seafloor.extent_east_m = 50.0;
  scene.seafloor.extent_north_m = 20.0;
  scene.sonars[0].range_m = 26.0;
  scene.sonars[0].bins = 520;
  scene.sonars[0].elevations = 1500;
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
    SimulatorInternals::count_object_visibility(simulator);
    const std::vector<Pose> poses = simulator.track();
    for (std::size_t i = 0; i < poses.size(); ++i)
      waterfall.set_row(i, simulator.ping_numbered(poses[i], i), {.pose = poses[i]});
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

/// Distance to the faces of one object.
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

/// Nearest and farthest bin of a region and an instance in one side of one ping; {n, 0} if there is
/// none.
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

TEST_CASE("Every labelled pixel lies on its object, within what else its bin contains") {
  Image image(level_scene(four_things()));
  const BinLayers& pixels = image.waterfall.pixels;
  std::map<std::uint32_t, int> seen;
  for (std::size_t i = 0; i < pixels.region.size(); ++i) {
    if (pixels.region[i] != static_cast<std::uint32_t>(Region::object)) continue;
    const Vector3d place(pixels.x_m[i], pixels.y_m[i], pixels.z_m[i]);
    const double off_m = distance_m(place, image.simulator.seafloor(), pixels.instance[i]);
    CAPTURE(pixels.instance[i], pixels.fraction[i], place.transpose());
    // A place is averaged over a bin and the beam's width; the rest of the energy comes from
    // the bed at the same range, at most two metres away.
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
  objects[1].size.shape_height_m = 1.5;
  Scene scene = level_scene(objects);
  scene.sonars[0].elevations = 12000;  // few rays pass under the round side
  Simulator simulator(scene);
  const std::vector<Pose> poses = simulator.track();
  const std::span<const EchoLine> lines = simulator.ping_numbered(poses[60], 60);
  const double bin_m = scene.sonars[0].bin_m();
  const auto check_shadow = [&](const EchoLine& line, std::uint32_t instance, double from_m,
                                double end_m) {
    const auto [first, last] = run_of(line, Region::shadow, instance);
    CAPTURE(instance);
    REQUIRE(last > first);
    CHECK(first > run_of(line, Region::object, instance).first);
    CHECK(std::abs(double(first) * bin_m - from_m) <= 2.5 * bin_m);
    CHECK(std::abs(double(last + 1) * bin_m - std::hypot(over_bed_m, end_m)) <= 2.5 * bin_m);
  };
  // The foot, under the round side, is seen last. The line over the top touches a circle of
  // radius r whose middle lies r above the bed at ground range x.
  const double r = 0.5, x = 14.0;
  const double depression =
      std::atan2(over_bed_m - r, x) - std::asin(r / std::hypot(x, over_bed_m - r));
  check_shadow(lines[1], 1, std::hypot(over_bed_m, x), over_bed_m / std::tan(depression));
  // X h / (h - t) for the far edge of the top, which is the last part that is seen.
  check_shadow(lines[0], 2, std::hypot(over_bed_m - 1.5, 12.0 + 0.6),
               (12.0 + 0.6) * over_bed_m / (over_bed_m - 1.5));
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

TEST_CASE("Buried objects are not seen, and others are, each once") {
  std::vector<ObjectOptions> objects = four_things();
  for (const std::size_t buried : {1, 2}) objects[buried].burial = 1.0;
  objects.push_back(thing("boulder", 10.0, 3.0));
  Scene scene = level_scene(objects);
  for (const double height_at_1m_m : {0.0, 0.1}) {
    CAPTURE(height_at_1m_m);
    scene.seafloor.fractal.height_at_1m_m = height_at_1m_m;
    std::vector<std::uint32_t> seen;
    for (const Target& target : find_targets(Image(scene).waterfall)) {
      seen.push_back(target.instance);
      CHECK(target.body.area_px > 0);
      CHECK(target.shadow.area_px > 0);
    }
    CHECK(seen == std::vector<std::uint32_t>{1, 4, 5});
  }
}

TEST_CASE("An object that is half sunk in has the shadow of the half above the bed") {
  std::vector<ObjectOptions> objects = {thing("box", 16.0, 0.0), thing("box", -16.0, 0.0)};
  for (ObjectOptions& box : objects) box.size.shape_height_m = 2.0;
  objects[1].burial = 0.5;
  Simulator simulator(level_scene(objects));
  const std::span<const EchoLine> lines = simulator.ping_numbered(simulator.track()[60], 60);
  const auto end_m = [&](std::size_t side, std::uint32_t instance) {
    const double slant_m = double(run_of(lines[side], Region::shadow, instance).second + 1) * 0.05;
    return std::sqrt(slant_m * slant_m - over_bed_m * over_bed_m);
  };
  CHECK(end_m(1, 1) == Approx(16.5 * 8.0 / 6.0).margin(0.15));
  CHECK(end_m(0, 2) == Approx(16.5 * 8.0 / 7.0).margin(0.15));
}

TEST_CASE("A target's box lies at its object and has the size of object and beam") {
  Image image(level_scene(four_things()));
  const std::vector<Target> targets = find_targets(image.waterfall);
  REQUIRE(targets.size() == 4);
  const double bin_m = image.waterfall.sonar.bin_m();
  for (const Target& target : targets) {
    CAPTURE(target.instance);
    const ObjectRecord& object = image.simulator.seafloor().objects[target.instance - 1];
    // Pings go north from y = -6 m; row 0 is the last ping.
    const double row = 119.0 - (object.middle_m.y() + 5.95) / ping_step_m;
    CHECK(0.5 * (target.body.low[1] + target.body.high[1] - 1) == Approx(row).margin(2.0));
    const double tall = target.body.high[1] - target.body.low[1];
    CHECK(tall * ping_step_m >= 0.9 * object.size_m.y() - ping_step_m);
    CHECK(tall * ping_step_m <= object.size_m.y() + 0.6);
    const bool port = object.middle_m.x() < 0.0;
    CHECK(target.sight.sector() == (port ? "port" : "starboard"));
    const double range_m = std::hypot(object.middle_m.x(), object.middle_m.z() + 20.0 - over_bed_m);
    CHECK(target.range_m == Approx(range_m).margin(0.6 * object.size_m.x() + 2.0 * bin_m));
    // The shadow follows the body, away from the sonar.
    CHECK((port ? target.shadow.low[0] < target.body.low[0]
                : target.shadow.high[0] > target.body.high[0]));
  }
}

TEST_CASE("In ground range an object lies at its distance, also below a vehicle's origin") {
  constexpr double middle_m = 14.0, width_m = 1.0;
  for (const double down_m : {0.0, 3.0}) {
    std::vector<ObjectOptions> objects = {thing("box", middle_m, 0.0)};
    objects[0].size = {.length_m = 4.0, .width_m = width_m, .shape_height_m = 0.05};
    Scene scene = level_scene(objects);
    scene.sonars[0].mounting.down_m = down_m;
    Simulator simulator(scene);
    Waterfall line = ping_all(scene, simulator, 1).images[0];
    CHECK(line.pings[60].altitude_m == Approx(over_bed_m).margin(1e-3));  // the vehicle's

    // A picture with the object alone.
    for (std::size_t i = 0; i < line.pixels.intensity.size(); ++i)
      line.pixels.intensity[i] = line.pixels.instance[i] == 1 ? 1.0f : 0.0f;
    const Calibration calibration{.level_bed = std::vector<double>(line.columns(), 1.0)};
    Display display{.of = DisplayedLayer::intensity, .slant_range_correction = true};
    const Picture picture = render(line, display, calibration);
    const LabelledImage ground = ground_view(slant_view(line, {}), line.sonar.bin_m());

    const std::size_t bins = ground.labels.columns() / 2;
    REQUIRE(bins == picture.width / 2);
    const auto check_place = [&](auto&& shows) {
      double low_m = 1e9, high_m = 0.0;
      for (std::size_t bin = 0; bin < bins; ++bin)
        if (shows(bins + bin)) {
          low_m = std::min(low_m, static_cast<double>(bin) * line.sonar.bin_m());
          high_m = static_cast<double>(bin + 1) * line.sonar.bin_m();
        }
      CAPTURE(down_m);
      CHECK(low_m == Approx(middle_m - 0.5 * width_m).margin(0.15));
      CHECK(high_m == Approx(middle_m + 0.5 * width_m).margin(0.15));
    };
    const std::size_t row = line.rows() / 2;
    check_place([&](std::size_t column) {
      return picture.pixels[(picture.height - 1 - row) * picture.width + column] > 0;
    });
    const std::size_t ground_row = ground.labels.rows() / 2;
    check_place([&](std::size_t column) {
      return ground.labels.pixels.instance[ground_row * ground.labels.columns() + column] == 1;
    });
  }
}

TEST_CASE("The reference tracer's ray to a labelled pixel hits its object first") {
  Image image(level_scene(four_things()));
  const Seafloor& seafloor = image.simulator.seafloor();
  const auto reference = make_intersector("pluecker", seafloor.mesh);
  const BinLayers& pixels = image.waterfall.pixels;
  const std::size_t columns = image.waterfall.columns();
  int asked = 0, met = 0;
  for (std::size_t i = 0; i < pixels.region.size(); ++i) {
    if (pixels.region[i] != static_cast<std::uint32_t>(Region::object) || pixels.fraction[i] < 0.9f)
      continue;
    const Vector3d from = image.waterfall.pings[i / columns].pose.position;
    const Vector3d place(pixels.x_m[i], pixels.y_m[i], pixels.z_m[i]);
    const Ray ray{from, (place - from).normalized(), 0.0, 100.0};
    Hit hit;
    reference->intersect({&ray, 1}, {&hit, 1});
    ++asked;
    // The bin's range, except for the beam's width on an oblique surface and for up to a tenth
    // of the energy, which may come from the bed.
    met += hit && seafloor.labels[seafloor.label_of(hit.face)].instance == pixels.instance[i] &&
           std::abs(hit.t - pixels.range_m[i]) < 0.2;
  }
  CAPTURE(asked, met);
  CHECK(asked > 50);
  CHECK(met >= 0.9 * asked);  // a mean of places around an edge may miss the object
}

TEST_CASE("The bed is in shadow where the reference's ray to it is blocked, and nowhere else") {
  Scene scene = level_scene(four_things());
  scene.track.pings = 60;
  Image image(scene);
  const auto reference = make_intersector("pluecker", image.simulator.seafloor().mesh);
  const BinLayers& pixels = image.waterfall.pixels;
  const std::size_t columns = image.waterfall.columns(), bins = columns / 2;
  int dark = 0, wrongly_dark = 0, lit = 0, wrongly_lit = 0;
  for (std::size_t i = 0; i < pixels.region.size(); ++i) {
    const auto region = static_cast<Region>(pixels.region[i]);
    const double range_m = pixels.range_m[i];
    if (range_m < over_bed_m + 0.3 || pixels.instance[i] != 0) continue;
    const bool shadow = region == Region::shadow;
    // Excludes the penumbra of a beam that is some decimetres wide.
    if (shadow ? pixels.shadow_fraction[i] < 0.999f : pixels.shadow_fraction[i] > 0.001f) continue;
    const Vector3d from = image.waterfall.pings[i / columns].pose.position;
    const double ground_m = std::sqrt(range_m * range_m - over_bed_m * over_bed_m);
    const double east_m = i % columns < bins ? -ground_m : ground_m;
    const Ray ray{from, Vector3d(east_m, 0.0, -over_bed_m).normalized(), 0.0, 100.0};
    Hit hit;
    reference->intersect({&ray, 1}, {&hit, 1});
    const bool cut = hit && hit.t < range_m - 0.1;
    shadow ? ++dark : ++lit;
    wrongly_dark += shadow && !cut;
    wrongly_lit += !shadow && cut;
    // No bin is starved over a level bed; a starved bin would not be a shadow.
    REQUIRE((region == Region::shadow || region == Region::seabed));
  }
  CAPTURE(dark, wrongly_dark, lit, wrongly_lit);
  CHECK(dark > 100);
  CHECK(lit > 20000);
  CHECK(wrongly_dark <= dark / 200);  // within a ping of an edge that runs along the beam
  CHECK(wrongly_lit <= lit / 2000);
}

TEST_CASE("The visible share is relative to the object alone: half buried, hidden, whole") {
  std::vector<ObjectOptions> objects = {thing("box", 16.0, 0.0), thing("box", -16.0, 0.0),
                                        thing("sphere", -19.0, 0.0), thing("cone", 24.0, 4.0)};
  for (const std::size_t tall : {0, 1}) objects[tall].size.shape_height_m = 2.0;
  objects[0].burial = 0.5;
  objects[1].size.length_m = 3.0;  // hides the sphere
  objects[2].size.diameter_m = 0.8;
  for (const char* surface : {"static", "refined"}) {
    Scene scene = level_scene(objects);
    scene.run.surface = surface;
    const Image image(scene);
    const std::span<const ObjectVisibility> views =
        SimulatorInternals::object_visibility(image.simulator, 0);
    REQUIRE(views.size() == 4);
    CAPTURE(surface);
    CHECK(views[1].share() == Approx(1.0).margin(0.01));
    CHECK(views[2].share() < 0.02);
    CHECK(views[3].share() == Approx(1.0).margin(0.01));
    // The front and top of a cube seen from 15.5 m away and 8 m up: the line of sight falls by
    // 8 / 15.5. The whole box reaches from a metre below the bed to a metre above it.
    const double foot = std::atan2(over_bed_m + 1.0, 15.5), bed = std::atan2(over_bed_m, 15.5),
                 back = std::atan2(over_bed_m - 1.0, 16.5);
    CHECK(views[0].share() == Approx((bed - back) / (foot - back)).margin(0.02));
  }
}

TEST_CASE("The part of an object beyond the range does not count as hidden") {
  // At 32 m the range ends over the box, whose faces are as long as its sides.
  ObjectOptions box = thing("box", 31.0, 0.0);
  box.size.length_m = 3.0;
  box.size.width_m = 3.0;
  box.size.shape_height_m = 0.3;
  const Image image(level_scene({box}));
  const ObjectVisibility view = SimulatorInternals::object_visibility(image.simulator, 0).front();
  CHECK(view.alone > 0);
  CHECK(view.share() == Approx(1.0).margin(0.01));
}

TEST_CASE("A ping that reaches no face sees nothing of an object that is near") {
  for (const char* surface : {"static", "refined", "footprint"}) {
    Scene scene = level_scene({});
    ObjectOptions cable = thing("cable", 0.0, 0.0);
    cable.path = {{3, -10}, {5, 0}, {4, 10}};
    scene.objects = {cable};
    scene.run.surface = surface;
    scene.sonars[0].range_m = 3.0;  // the bed is 8 m below
    scene.track.pings = 2;
    const Image image(scene);
    CAPTURE(surface);
    for (const float mean : image.waterfall.pixels.intensity_mean) CHECK(mean == 0.0f);
    for (const ObjectVisibility& view : SimulatorInternals::object_visibility(image.simulator, 0))
      CHECK(view.alone == 0);
  }
}

TEST_CASE("What a bin saw lies at its range, on crests seen edge-on too") {
  Scene scene = fine_scene({}, 0.1);
  scene.seafloor.seabed.boulders.resize(1);
  scene.seafloor.seabed.boulders[0].relief = {
      .per_hectare = 1500.0, .diameter_m = 1.2, .height_ratio = 0.7};
  scene.seafloor.seabed.bedforms.resize(1);
  scene.seafloor.seabed.bedforms[0].relief = {
      .wavelength_m = 1.5, .height_m = 0.25, .across_crests_rad = 1.5};
  const Image image(scene);
  const BinLayers& pixels = image.waterfall.pixels;
  const std::size_t columns = image.waterfall.columns();
  int lit = 0;
  double farthest_m = 0.0;
  for (std::size_t i = 0; i < pixels.region.size(); ++i) {
    // The mean of several places, as in layover, lies nearer.
    if (pixels.fraction[i] == 0.0f || pixels.layover[i] != 0) continue;
    ++lit;
    const Vector3d place(pixels.x_m[i], pixels.y_m[i], pixels.z_m[i]);
    const Vector3d sonar = image.waterfall.pings[i / columns].pose.position;
    farthest_m = std::max(farthest_m, std::abs((place - sonar).norm() - pixels.range_m[i]));
  }
  CHECK(lit > 20'000);
  // Between two rays, an echo lies over the ranges between their places. On a slope that is nearly
  // edge-on these lie up to a third of a crest apart.
  CHECK(farthest_m < 0.5);
}

TEST_CASE("Each boulder, pit and furrow of a layer is an instance, and its pixels lie on it") {
  Scene scene = fine_scene({thing("box", 12.0, 0.0)}, 0.15);
  scene.seafloor.seabed.boulders.resize(1);
  scene.seafloor.seabed.boulders[0].relief = {
      .per_hectare = 300.0, .diameter_m = 1.2, .diameter_spread = 0.2, .height_ratio = 0.7};
  scene.seafloor.seabed.pits.resize(1);
  scene.seafloor.seabed.pits[0].relief = {.per_hectare = 150.0, .diameter_m = 3.0};
  scene.seafloor.seabed.trawl_marks.resize(1);
  scene.seafloor.seabed.trawl_marks[0].relief = {.count = 1, .door_spacing_m = 10.0};
  const Image image(scene);
  const Seafloor& seafloor = image.simulator.seafloor();
  std::map<std::string, int> of_class;
  for (std::size_t i = 0; i < seafloor.features.size(); ++i) {
    CHECK(seafloor.features[i].label.instance == i + 2);  // instance 1 is the box
    ++of_class[seafloor.classes[seafloor.features[i].label.class_id]];
  }
  CHECK(of_class["boulder"] > 10);
  CHECK(of_class["pockmark"] > 5);
  CHECK(of_class["trawl_mark"] <= 2);
  const BinLayers& pixels = image.waterfall.pixels;
  int looked = 0;
  for (std::size_t i = 0; i < pixels.region.size(); ++i) {
    if (pixels.instance[i] == 1)
      CHECK(pixels.region[i] != static_cast<std::uint32_t>(Region::seabed));
    if (pixels.instance[i] < 2 || pixels.fraction[i] < 0.99f) continue;
    CHECK(pixels.region[i] != static_cast<std::uint32_t>(Region::object));  // forms of the bed
    const FeatureRecord& feature = seafloor.features.at(pixels.instance[i] - 2);
    REQUIRE(feature.label.class_id == pixels.class_id[i]);
    const Vector3d off = Vector3d(pixels.x_m[i], pixels.y_m[i], pixels.z_m[i]) - feature.middle_m;
    // A face at a feature's border may rise to a boulder that stands next to it.
    const Vector3d border_m(0.35, 0.35, 1.0);
    REQUIRE((off.cwiseAbs() - 0.5 * feature.size_m - border_m).maxCoeff() <= 0.0);
    ++looked;
  }
  CHECK(looked > 50);
  int boulders = 0;
  for (const Target& target : find_targets(image.waterfall))
    boulders += target.instance > 1 && target.body.area_px > 0 && target.shadow.area_px > 0;
  CHECK(boulders > 1);
}
