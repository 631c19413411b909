// A whole ping, for all face sources and back-ends.

#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <string>

#include <fmt/format.h>

#include "support/beds.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/files.h"
#include "support/meshes.h"
#include "support/paths.h"
#include "support/temporary_folder.h"

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/image/display.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/bed/tessellate.h>
#include <ensonify/engine/simulator/ping_all.h>
#include <ensonify/engine/sonar/reception/recorder.h>
#include <ensonify/engine/trace/face_sources/exact_faces.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/refine/mesh_reader.h>

using namespace ensonify;
using namespace ensonify::engine;

namespace {

/// A rough bed with a box on it, under two sonars that look to the sides and one that looks ahead.
Scene busy_scene(const tests::TemporaryFolder& folder) {
  Seafloor holder;
  tests::add_box(holder, {0, 0, 0}, {4, 2, 3});
  refine::write_ply(folder / "box.ply", holder.mesh);
  Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 60.0;
  scene.seafloor.cell_m = 0.5;
  scene.objects.push_back({.mesh = {"box.ply", folder / "box.ply"},
                           .class_name = "box",
                           .east_m = 12.0,
                           .north_m = 3.0,
                           .heading_rad = 0.4});
  scene.sonars.front().range_m = 30.0;
  scene.sonars.front().bins = 300;
  scene.sonars.front().elevations = 400;
  Sonar& ahead = scene.sonars.emplace_back(scene.sonars.front());
  ahead.name = "low";
  ahead.frequency_hz = 100e3;
  ahead.range_m = 20.0;
  Sonar& obstacles = scene.sonars.emplace_back(scene.sonars.front());
  obstacles.name = "obstacles";
  obstacles.sides = Sides::starboard;
  obstacles.mounting = {.forward_m = 0.8, .down_m = 0.1, .azimuth_rad = -1.5707963267948966};
  scene.track.pings = 30;
  scene.track.heading_rad = 0.1;
  return scene;
}

/// Every number of every line of every ping.
std::vector<double> everything(const Scene& scene) {
  Simulator simulator(scene);
  const std::vector<Pose> poses = simulator.track();
  std::vector<double> all;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i % 10 == 0) SimulatorInternals::reset(simulator);
    for (const EchoLine& line : simulator.ping_numbered(poses[i], i))
      BinLayers::for_each([&](std::string_view, auto layer) {
        all.insert(all.end(), (line.bins.*layer).begin(), (line.bins.*layer).end());
      });
    all.push_back(simulator.altitude_m(poses[i].position));
  }
  return all;
}

}  // namespace

TEST_CASE("neither the face source nor kept trees change a number of a ping") {
  const tests::TemporaryFolder folder;
  Scene scene = busy_scene(folder);
  for (const char* intersector : {"fan_scan", "embree"}) {
    scene.run.intersector = intersector;
    scene.run.surface = "static";
    scene.run.tree_pings = 1;
    const std::vector<double> whole = everything(scene);
    for (const char* surface : {"refined", "footprint"})
      for (const int tree_pings : {1, 6}) {
        CAPTURE(intersector, surface, tree_pings);
        scene.run.surface = surface;
        scene.run.tree_pings = tree_pings;
        CHECK(everything(scene) == whole);
      }
  }
}

TEST_CASE("a bed of heights gives the numbers of its mesh: holes, objects, labels, grid lines") {
  const tests::TemporaryFolder folder;
  // 70 x 66 points of 0.4 m: more than a tile in both directions.
  std::string grid =
      "ncols 70\nnrows 66\nxllcorner 500000\nyllcorner 4000000\ncellsize 0.4\nNODATA_value "
      "-9999\n";
  std::array<double, 2> u;
  for (std::uint64_t i = 0; i < 70 * 66; ++i) {
    RandomStream(5, Purpose::test, {i, 0, 0}).uniform(u);
    grid += u[0] < 0.03 ? "-9999 " : fmt::format("{:.4f} ", -10.0 - 0.3 * u[1]);
    if (i % 70 == 69) grid += "\n";
  }
  tests::write_text(folder / "grid.asc", grid);
  Scene scene;
  SECTION("a survey with holes") {
    scene.seafloor.kind = SeafloorKind::survey;
    scene.seafloor.survey = {"grid.asc", folder / "grid.asc"};
  }
  SECTION("a generated bed with layers and objects") {
    scene.seafloor.extent_east_m = 28.0;
    scene.seafloor.extent_north_m = 26.0;
    scene.seafloor.cell_m = 0.2;
    scene.seafloor.depth_m = 10.0;
    scene.seafloor.seabed.bedforms.emplace_back().material = "silt";
    scene.seafloor.seabed.boulders.emplace_back().class_name = "stone";
    for (const double east_m : {-7.0, 3.0, 8.0})
      scene.objects.push_back({.shape = "sphere", .class_name = "ball", .east_m = east_m});
  }
  scene.sonars.front().range_m = 18.0;
  scene.sonars.front().bins = 150;
  scene.sonars.front().elevations = 80;
  scene.track.pings = 3;
  scene.track.altitude_m = 4.0;
  scene.track.speed_mps = 50.0;                  // on to other tiles
  for (const double heading_rad : {0.0, 0.7}) {  // along the lines of the grid, and across
    scene.track.heading_rad = heading_rad;
    for (const IntersectorKind& kind : intersector_kinds()) {
      CAPTURE(kind.name, heading_rad);
      scene.run.intersector = kind.name;
      scene.run.surface = "static";
      const std::vector<double> whole = everything(scene);
      scene.run.surface = "footprint";
      CHECK(Simulator(scene).seafloor().grid);
      CHECK(everything(scene) == whole);
    }
  }
}

TEST_CASE("a sonar with one side receives the same as that side of a sonar with two, to the bit") {
  const tests::TemporaryFolder folder;
  Scene scene = busy_scene(folder);
  scene.sonars.resize(1);
  scene.motion.roll.rms = 0.05;
  for (const char* surface : {"static", "refined"}) {
    scene.run.surface = surface;
    scene.sonars.front().sides = Sides::both;
    Simulator two(scene);
    scene.sonars.front().sides = Sides::port;
    Simulator port(scene);
    scene.sonars.front().sides = Sides::starboard;
    Simulator starboard(scene);
    const std::vector<Pose> track = two.track();
    for (std::size_t ping = 0; ping < track.size(); ping += 3) {
      const std::span<const EchoLine> whole = two.ping_numbered(track[ping], ping);
      REQUIRE(whole.size() == 2);
      for (Simulator* half : {&port, &starboard}) {
        const std::span<const EchoLine> lines = half->ping_numbered(track[ping], ping);
        REQUIRE(lines.size() == 1);
        const EchoLine& expected = whole[half == &port ? 0 : 1];
        REQUIRE(lines[0].sector == 0);
        REQUIRE(lines[0].first_return == expected.first_return);
        BinLayers::for_each([&](std::string_view name, auto layer) {
          CAPTURE(name);
          REQUIRE(lines[0].bins.*layer == expected.bins.*layer);
        });
      }
    }
  }
}

TEST_CASE("fewer than 32 elevations are warned of") {
  Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 20.0;
  scene.seafloor.cell_m = 1.0;
  scene.sonars.resize(1);
  scene.sonars[0].name = "s";
  for (const int elevations : {31, 32}) {
    scene.sonars[0].elevations = elevations;
    const Simulator simulator(scene);
    const auto few = std::ranges::count_if(simulator.warnings(), [](const std::string& warning) {
      return warning.find("s: with only 31 elevations") != std::string::npos;
    });
    CHECK(few == (elevations == 31 ? 1 : 0));
  }
}

TEST_CASE("swaths that reach beyond the edge of the bed are warned of, with the bins' true share") {
  Scene scene;
  scene.seafloor.extent_east_m = 100.0;
  scene.seafloor.extent_north_m = 60.0;
  scene.seafloor.cell_m = 1.0;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.track.pings = 4;
  scene.track.altitude_m = 10.0;
  scene.sonars.resize(1);
  scene.sonars[0].name = "s";
  scene.sonars[0].range_m = 50.0;
  scene.sonars[0].bins = 500;
  for (const double east_m : {0.0, 20.0}) {
    scene.track.middle_east_m = east_m;
    Simulator simulator(scene);
    const std::vector<std::string> warnings = TrackPings(scene, simulator).warnings();
    if (east_m == 0.0) {
      CHECK(warnings.empty());
      continue;
    }
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], Catch::StartsWith("sonar s: 18 % of its bins ") &&
                                Catch::Contains("in 4 of 4 pings (numbers 0 to 3)") &&
                                Catch::Contains("seafloor.extent_east_m = 138") &&
                                Catch::Contains("seafloor.extent_north_m = 60") &&
                                Catch::Contains("sonar.s.range_m"));
    const Waterfall image = ping_all(scene, simulator, 1).images.front();
    int starved = 0;
    for (const PingRow& row : image.pings) starved += row.lines[0].starved + row.lines[1].starved;
    CHECK(starved / (4.0 * 1000.0) == Approx(0.184).margin(0.01));
  }
}

TEST_CASE("a range that ends above the bed in all pings is warned of, for the place of the sonar") {
  Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 40.0;
  scene.seafloor.cell_m = 1.0;
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.track.pings = 4;
  scene.track.altitude_m = 12.0;
  scene.sonars.resize(1);
  scene.sonars[0].name = "s";
  scene.sonars[0].range_m = 10.0;
  scene.sonars[0].bins = 100;
  for (const double down_m : {0.0, 5.0}) {
    scene.sonars[0].mounting.down_m = down_m;
    Simulator simulator(scene);
    const TrackPings pings(scene, simulator);
    const ScenePings made = ping_all(scene, simulator, 1);
    if (down_m > 0.0) {
      CHECK(pings.warnings().empty());
      CHECK(made.hits > 0);
      continue;
    }
    REQUIRE(pings.warnings().size() == 1);
    CHECK_THAT(pings.warnings()[0],
               Catch::StartsWith("sonar s: in all 4 pings ") && Catch::Contains("12 m or more") &&
                   Catch::Contains("range of 10 m") && Catch::Contains("sonar.s.range_m"));
    CHECK(made.hits == 0);
  }
}

TEST_CASE("a sonar that looks ahead sees what lies ahead, before the sidescan does") {
  const tests::TemporaryFolder folder;
  Scene scene = busy_scene(folder);
  Simulator simulator(scene);
  // South of the box, heading north to it.
  const std::span<const EchoLine> lines =
      simulator.ping_numbered({.position = {12.0, -12.0, -14.0}}, 0);
  REQUIRE(lines.size() == 5);
  const auto sees_box = [&](const EchoLine& line) {
    return std::ranges::count(line.bins.instance, 1u) > 0;
  };
  CHECK(sees_box(lines[4]));
  CHECK(lines[4].sector == 0);
  for (std::size_t i = 0; i < 4; ++i) CHECK_FALSE(sees_box(lines[i]));
  for (std::size_t bin = 0; bin < lines[4].bins.instance.size(); ++bin)
    if (lines[4].bins.instance[bin] == 1) {
      CHECK(lines[4].bins.y_m[bin] == Approx(3.0).margin(3.0));
      break;
    }
}

TEST_CASE("a million rays of each scene have the same hits on each face source, to the bit",
          "[.soak]") {
  const auto data = tests::data_file("mesh_underwater/skytteren_wreck.ply");
  if (!data) WARN("skipped two scenes: the real data are not there");
  for (const char* name : {"ripples", "rocky", "wreck", "survey_portsmouth"}) {
    const auto file = tests::source_folder() / "scenes" / (std::string(name) + ".toml");
    const bool real = std::string(name) == "wreck" || std::string(name) == "survey_portsmouth";
    if (real && !data) continue;
    Scene scene = read_scene(file, {}, real ? data->parent_path().parent_path() : "");
    scene.run.surface = "static";  // with a mesh of the bed
    Simulator simulator(scene);
    const refine::TriangleMesh& mesh = simulator.seafloor().mesh;
    const auto whole = make_intersector("embree", mesh);
    const FaceSourceParts parts{.progressive = make_progressive_mesh(mesh),
                                .intersector = "embree"};
    const auto refined = make_refined_faces(parts), footprint = make_footprint_faces(parts);
    const std::vector<Pose> track = simulator.track();
    std::size_t rays = 0, hits = 0, ties = 0, hit_or_miss = 0, others = 0;
    std::vector<Hit> expected, found;
    for (std::size_t ping = 0; rays < 1000000; ping = (ping + 7) % track.size()) {
      const std::span<const RayFan> fans = SimulatorInternals::aim(simulator, track[ping]);
      for (FaceSource* surface : {refined.get(), footprint.get()}) {
        const Intersector& exact = *surface->prepare(fans).intersector;
        for (const RayFan& fan : fans) {
          expected.resize(fan.grid->rays());
          found.resize(fan.grid->rays());
          whole->intersect(fan, expected);
          exact.intersect(fan, found);
          for (std::size_t i = 0; i < found.size(); ++i) {
            hits += static_cast<bool>(expected[i]);
            if (found[i].face == expected[i].face && found[i].t == expected[i].t) continue;
            if (static_cast<bool>(found[i]) != static_cast<bool>(expected[i]))
              ++hit_or_miss;
            else
              ++(found[i].t == expected[i].t ? ties : others);
          }
          if (surface == refined.get()) rays += found.size();
        }
      }
    }
    WARN(name << ": " << rays << " rays, " << ties << " ties, " << hit_or_miss << " hit or miss, "
              << others << " others");
    CHECK(hits > rays / 3);
    CHECK(ties <= rays / 10000);
    CHECK(hit_or_miss == 0);
    CHECK(others == 0);
  }
}

TEST_CASE("an object is seen as itself, as is its shadow, and the altitude looks through it") {
  const tests::TemporaryFolder folder;
  Scene scene = busy_scene(folder);
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  Simulator simulator(scene);
  Pose pose;
  pose.position = {0.0, 3.0, -10.0};
  const EchoLine& starboard = simulator.ping_numbered(pose, 0)[1];
  bool object = false, shadow = false, port_object = false;
  for (std::size_t i = 0; i < starboard.bins.region.size(); ++i) {
    const BinLayers& bins = starboard.bins;
    if (bins.instance[i] == 1) {
      object = true;
      // Where most planes skip the bin it is shadow, whatever the other planes see.
      CHECK((bins.region[i] == static_cast<std::uint32_t>(Region::object) ||
             bins.shadow_fraction[i] > 0.5f));
      CHECK(simulator.seafloor().classes.at(bins.class_id[i]) == "box");
      CHECK(simulator.seafloor().materials.at(bins.sediment[i]) == "fouled steel");
      CHECK(std::abs(bins.x_m[i] - 12.0) < 3.0);
    }
    shadow = shadow || (bins.region[i] == static_cast<std::uint32_t>(Region::shadow) &&
                        bins.shadow_instance[i] == 1);
  }
  for (const std::uint32_t instance : simulator.ping_numbered(pose, 0)[0].bins.instance)
    port_object = port_object || instance != 0;
  CHECK(object);
  CHECK(shadow);
  CHECK_FALSE(port_object);
  CHECK(simulator.altitude_m({12.0, 3.0, -10.0}) == Approx(10.0));
}

TEST_CASE("an imported plate scatters from its back as from its front") {
  const tests::TemporaryFolder folder;
  Scene scene = busy_scene(folder);
  scene.objects.front().height_m = 1.0;
  scene.objects.front().north_m = 0.0;
  const auto echo_of = [&](const refine::Face& one, const refine::Face& other) {
    refine::write_ply(
        folder / "box.ply",
        {.positions = {{0, 0, 0}, {4, 0, 0}, {4, 4, 2}, {0, 4, 2}}, .faces = {one, other}});
    return everything(scene);
  };
  const std::vector<double> up = echo_of({0, 1, 2}, {0, 2, 3});
  const std::vector<double> down = echo_of({0, 2, 1}, {0, 3, 2});
  REQUIRE(up.size() == down.size());
  std::size_t differ = 0;
  for (std::size_t i = 0; i < up.size(); ++i)
    differ += std::abs(up[i] - down[i]) > 1e-3 * std::abs(up[i]) + 1e-6;
  CHECK(differ <= up.size() / 10000);  // the last bits of t depend on the corners' order
}

TEST_CASE(
    "a cast gives the sound speed down to the bed, and a cast that ends above it is reported") {
  const tests::TemporaryFolder folder;
  Scene scene = busy_scene(folder);
  scene.sea.sound_speed_mps = 1497.0;
  scene.sea.absorption_db_per_km = 100.0;  // otherwise absorption comes from the cast, too
  const std::vector<double> by_number = everything(scene);

  scene.sea.sound_speed_mps.reset();
  scene.sea.profile = {"cast.csv", folder / "cast.csv"};
  std::ofstream(folder / "cast.csv") << "depth_m,soundspeed_mps\n0,1497\n40,1497\n";
  CHECK(everything(scene) == by_number);
  const auto of_cast = [](const std::string& warning) { return warning.starts_with("cast.csv"); };
  const Simulator deep(scene);
  CHECK(std::ranges::none_of(deep.warnings(), of_cast));

  std::ofstream(folder / "cast.csv") << "depth_m,soundspeed_mps\n0,1497\n10,1497\n";
  CHECK(everything(scene) == by_number);
  const Simulator shallow(scene);
  CHECK(std::ranges::any_of(shallow.warnings(), of_cast));
}

TEST_CASE("a scene gives the same ranges at the origin, in UTM and ten thousand kilometres out") {
  const tests::TemporaryFolder folder;
  Scene scene = busy_scene(folder);
  scene.run.surface = "static";
  refine::TriangleMesh bed = tessellate(make_heightfield(scene.seafloor, 1));
  scene.seafloor.kind = SeafloorKind::mesh;
  scene.seafloor.mesh.path = folder / "bed.ply";
  std::vector<Hit> first;
  for (const Eigen::Vector3d& origin :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(405123, 6201987, 0),
        Eigen::Vector3d(1e7, -1e7, 0)}) {
    bed.world_origin = origin;
    refine::write_ply(folder / "bed.ply", bed);
    Simulator simulator(scene);
    CHECK(simulator.seafloor().mesh.world_origin == origin);
    const auto tracer = make_intersector("embree", simulator.seafloor().mesh);
    std::vector<Hit> hits;
    for (const RayFan& fan : SimulatorInternals::aim(simulator, simulator.track()[7])) {
      std::vector<Hit> of_fan(fan.grid->rays());
      tracer->intersect(fan, of_fan);
      hits.insert(hits.end(), of_fan.begin(), of_fan.end());
    }
    if (first.empty()) first = hits;
    REQUIRE(hits.size() == first.size());
    std::size_t found = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      REQUIRE(hits[i].face == first[i].face);
      if (hits[i]) REQUIRE(std::abs(hits[i].t - first[i].t) < 1e-4);
      found += static_cast<bool>(hits[i]);
    }
    CHECK(found > hits.size() / 3);
  }
}

TEST_CASE("Refraction in water of one speed changes nothing, and times alone shift the bins") {
  const tests::TemporaryFolder folder;
  const auto cast = [&](const char* name, const char* rows) {
    std::ofstream(folder / name) << "depth_m,soundspeed_mps\n" << rows;
    return InputFile{name, folder / name};
  };
  Scene scene = busy_scene(folder);
  scene.objects.clear();
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  scene.track.pings = 2;
  scene.speckle = false;
  scene.sea.profile = cast("still.csv", "0,1500\n30,1500\n");
  const std::vector<double> straight = everything(scene);
  scene.sea.refraction = RefractionMode::full;
  CHECK(everything(scene) == straight);

  // Slow where the rays run: echoes arrive later and seem farther away by the ratio of the speeds.
  scene.sea.profile = cast("slow.csv", "0,1530\n8,1530\n8.1,1470\n30,1470\n");
  const auto first = [&](RefractionMode mode) {
    scene.sea.refraction = mode;
    Simulator simulator(scene);
    const Pose pose = simulator.track().front();
    REQUIRE(pose.position.z() < -8.1);
    return simulator.ping_numbered(pose, 0).front().first_return;
  };
  const double depth_m = -double(Simulator(scene).seafloor().bounds().lowest.z());
  const double mean = depth_m / (8.05 / 1530 + (depth_m - 8.05) / 1470);
  const int off = first(RefractionMode::off);
  CHECK(first(RefractionMode::time_only) == Approx(off * mean / 1470.0).margin(1.0));
  CHECK(first(RefractionMode::full) == Approx(off * mean / 1470.0).margin(1.0));
  CHECK(first(RefractionMode::full) > off);

  scene.run.intersector = "embree";
  const std::vector<double> by_embree = everything(scene);
  scene.run.intersector = "fan_scan";  // rays that it cannot trace go to a tree
  const std::vector<double> by_scan = everything(scene);
  REQUIRE(by_scan.size() == by_embree.size());
  for (std::size_t i = 0; i < by_scan.size(); ++i)
    if (!(std::isnan(by_scan[i]) && std::isnan(by_embree[i])))
      REQUIRE(by_scan[i] == Approx(by_embree[i]).epsilon(1e-3));
}

TEST_CASE("However far from the seafloor's middle, Embree hits what the reference hits") {
  // Relief of 0.5 m cells under a sonar 12 m up, moved away from the middle together. Embree's own
  // rounding leaves a ray in ten thousand to a neighbouring face.
  for (const double away_km : {0.0, 1.0, 10.0, 50.0, 500.0}) {
    CAPTURE(away_km);
    const Eigen::Vector3d away(800.0 * away_km + 0.123, 600.0 * away_km + 0.456, 0.0);
    auto prepared = std::make_shared<PreparedSeafloor>();
    Seafloor& bed = prepared->seafloor;
    bed.mesh = tests::open_grid(160, 160, 0.5, 0.3, 5);
    const refine::Bounds box = refine::bounds(bed.mesh);
    const Eigen::Vector3d middle = 0.5 * (box.lowest + box.highest).cast<double>();
    for (Eigen::Vector3f& p : bed.mesh.positions)
      p = (p.cast<double>() - middle + away - Eigen::Vector3d(0, 0, 20)).cast<float>();
    bed.bed_faces = bed.faces = bed.mesh.faces.size();
    bed.labels = {{1, 1, 0}};
    bed.materials = {"none", "medium sand"};
    bed.classes = {"none", "seabed"};
    bed.mean_bed_m = -20.0;
    prepared->origin.surface = "static";

    Scene scene;
    scene.sonars.front().range_m = 40.0;
    std::vector<std::vector<std::vector<Hit>>> hits;
    for (const char* intersector : {"pluecker", "embree"}) {
      scene.run.intersector = intersector;
      Simulator simulator(scene, {.seafloor = prepared});
      for (int ping = 0; ping < 3; ++ping)
        hits.push_back(SimulatorInternals::hits(
            simulator, {.position = away + Eigen::Vector3d(0.37 * ping, 0.11 * ping, -8.0)}));
    }
    std::size_t rays = 0, others = 0, apart = 0;
    for (std::size_t ping = 0; ping < 3; ++ping)
      for (std::size_t side = 0; side < hits[ping].size(); ++side)
        for (std::size_t i = 0; i < hits[ping][side].size(); ++i) {
          const Hit &exact = hits[ping][side][i], &found = hits[ping + 3][side][i];
          rays += static_cast<bool>(exact);
          others += found.face != exact.face;
          apart += exact && std::abs(found.t - exact.t) > 1e-3;
        }
    CHECK(rays > 30000);
    CHECK(others <= rays / 10000);
    CHECK(apart <= rays / 10000);
  }
}

TEST_CASE("a track from a file pings like the line with its altitude, speed and interval") {
  const tests::TemporaryFolder folder;
  Scene line;
  line.seafloor.extent_east_m = line.seafloor.extent_north_m = 60.0;
  line.seafloor.cell_m = 2.0;
  line.seafloor.fractal.height_at_1m_m = 0.0;
  line.speckle = line.texture = false;
  Sonar& sonar = line.sonars.front();
  sonar.range_m = 30.0;
  sonar.bins = 300;
  sonar.elevations = 400;
  sonar.receiver.self_noise_db = 40.0;
  line.arrivals.second_time_around = true;
  line.track.pings = 11;
  line.track.altitude_m = 5.0;
  line.track.speed_mps = 3.0;
  line.track.ping_interval_s = 0.09;

  Simulator along_line(line);
  std::ofstream csv(folder / "track.csv");
  csv << "t_s,x_m,y_m,z_m,heading_deg\n";
  const std::vector<Pose> poses = along_line.track();
  for (const Pose& pose : poses)
    csv << fmt::format("{},{},{},{},0\n", pose.t_s, pose.position.x(), pose.position.y(),
                       pose.position.z());
  csv.close();
  Scene recorded = line;
  recorded.track = {.kind = TrackKind::file, .file = {"track.csv", folder / "track.csv"}};
  recorded.track.altitude_m = 14.0;  // not of a file
  for (const char* surface : {"static", "refined"}) {
    CAPTURE(surface);
    recorded.run.surface = surface;
    Simulator along_file(recorded);
    CHECK(along_file.track().size() == poses.size());
    CHECK(SimulatorInternals::recorder(along_file, 0).gains().front() ==
          Approx(SimulatorInternals::recorder(along_line, 0).gains().front()).epsilon(1e-5));
    for (std::size_t i = 0; i < along_line.calibration(0).level_bed.size(); ++i)
      REQUIRE(along_file.calibration(0).level_bed[i] ==
              Approx(along_line.calibration(0).level_bed[i]).epsilon(1e-4));
    const EchoLine& expected = along_line.ping_numbered(poses[5], 5).front();
    const EchoLine& found = along_file.ping_numbered(poses[5], 5).front();
    for (std::size_t i = 0; i < expected.bins.intensity.size(); ++i)
      REQUIRE(found.bins.intensity[i] == Approx(expected.bins.intensity[i]).epsilon(1e-3));
  }
}
