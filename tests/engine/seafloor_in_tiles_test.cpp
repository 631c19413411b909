// A bed in tiles against the same bed in memory, and what such a bed refuses.

#include <ensonify/engine/seafloor/seafloor_in_tiles.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/make_seafloor.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/internals.h>
#include <ensonify/engine/simulator/prepare.h>
#include <ensonify/refine/height_tiles.h>
#include <ensonify/refine/mesh_clusters.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/grids.h"
#include "support/temporary_folder.h"

using namespace ensonify::engine;
using namespace ensonify::tests;

namespace {

/// A bed with waves of all kinds, and holes of some points, some of them on borders of chunks.
Tiff survey(std::uint32_t cells, bool holes) {
  Tiff tiff;
  tiff.columns = tiff.rows = cells + 1;
  tiff.transform = {500000, 0.25, 0, 4000000, 0, -0.25};
  tiff.nodata = "-9999";
  std::uint32_t noise = 1;
  for (std::uint32_t row = 0; row <= cells; ++row)
    for (std::uint32_t column = 0; column <= cells; ++column) {
      noise = noise * 1664525u + 1013904223u;
      const double x = column, y = row;
      const bool hole = holes && (column % 512 < 3) && (row % 300 < 5);
      tiff.heights.push_back(hole ? -9999.0f
                                  : static_cast<float>(-20.0 + 0.8 * std::sin(0.011 * x) +
                                                       0.5 * std::cos(0.017 * y + 0.003 * x) +
                                                       2e-11 * noise));
    }
  return tiff;
}

/// The mean height would follow from other points: sound speed and absorption are given.
std::string scene_text(std::string_view intersector) {
  return std::string(R"(version = 1
[seafloor]
kind = "survey"
survey = "bed.tif"
[sea]
sound_speed_mps = 1500
absorption_db_per_km = 30
[sonar.left-right]
range_m = 40
bins = 300
elevations = 512
[[objects]]
shape = "cylinder"
east_m = 3.5
north_m = 2
[run]
intersector = ")") +
         std::string(intersector) + "\"\n";
}

std::vector<float> pings(const Scene& scene, Seafloor seafloor, const std::vector<Pose>& poses,
                         const std::string& surface = "footprint") {
  auto prepared = std::make_shared<PreparedSeafloor>();
  prepared->seafloor = std::move(seafloor);
  prepared->origin.surface = surface;
  if (surface == "refined")
    prepared->clusters = std::make_shared<ensonify::refine::MeshClusters>(
        *prepared->seafloor.grid, prepared->seafloor.mesh, std::filesystem::path(), "");
  Simulator simulator(scene, {.seafloor = prepared});
  std::vector<float> all;
  std::uint64_t number = 0;
  for (const Pose& pose : poses)
    for (const EchoLine& line : simulator.ping_numbered(pose, number++)) {
      const auto& mean = line.bins.intensity_mean;
      all.insert(all.end(), mean.begin(), mean.end());
    }
  return all;
}

bool same_bytes(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

}  // namespace

TEST_CASE("A survey in tiles has the echoes of the survey in memory, over borders and corners") {
  const TemporaryFolder folder;
  const std::uint32_t cells = GENERATE(1500u, 2300u);  // chunks of 1024
  const bool holes = GENERATE(false, true);
  CAPTURE(cells, holes);
  write_text(folder / "bed.tif", survey(cells, holes).bytes());
  // The border between two chunks.
  const double border_m = 0.25 * (1024 - 0.5 * cells);
  std::vector<Pose> poses;
  for (int i = 0; i < 6; ++i) {
    // Along a border, and across the corner, where the object stands for the smaller bed.
    poses.push_back({.position = {border_m + 0.01 * i, 20.0 + 0.3 * i, -8.0}});
    poses.push_back({.position = {border_m - 1.0 + 0.4 * i, border_m - 1.0 + 0.4 * i, -8.0}});
    poses.push_back({.position = {2.0 + 0.3 * i, 1.0, -8.0}});
  }
  for (const char* intersector : {"fan_scan", "embree"}) {
    CAPTURE(intersector);
    const Scene scene =
        parse_scene(scene_text(intersector), "scene", {}, {.scene_folder = folder.path()});
    const auto in_tiles = [&](const std::string& file) {
      return make_seafloor_in_tiles(scene.seafloor, scene.bed_seed(), scene.objects,
                                    scene.materials,
                                    {file.empty() ? std::string() : (folder / file).string(), "k"});
    };
    const std::vector<float> expected =
        pings(scene,
              make_seafloor(scene.seafloor, scene.bed_seed(), scene.objects, scene.materials, {},
                            BedForm::grid),
              poses);
    CHECK(same_bytes(pings(scene, in_tiles(""), poses), expected));
    CHECK(same_bytes(pings(scene, in_tiles("bed.tiles"), poses), expected));
    CHECK(same_bytes(pings(scene, in_tiles("bed.tiles"), poses), expected));  // from the file
    // Other faces make other trees, and Embree's rounding follows the tree.
    if (std::string_view(intersector) == "fan_scan")
      CHECK(same_bytes(pings(scene, in_tiles("bed.tiles"), poses, "refined"), expected));
  }
}

TEST_CASE("Layers on a survey in tiles have the echoes and the labels that they have in memory") {
  const TemporaryFolder folder;
  const bool holes = GENERATE(false, true);
  CAPTURE(holes);
  constexpr std::uint32_t cells = 1300;
  write_text(folder / "bed.tif", survey(cells, holes).bytes());
  const double border_m = 0.25 * (1024 - 0.5 * cells);
  std::vector<Pose> poses;
  for (int i = 0; i < 6; ++i)
    poses.push_back({.position = {border_m - 1.0 + 0.4 * i, border_m - 1.0 + 0.4 * i, -8.0}});
  const Scene scene = parse_scene(scene_text("fan_scan") + R"(
[[seafloor.patches]]
material = "sandy gravel"
polygon_m = [[60, 60], [110, 80], [100, 120], [70, 110]]
[[seafloor.crests]]
on = "sandy gravel"
wavelength_m = 1.5
[[seafloor.pits]]
class = ""
per_hectare = 80
diameter_m = 3
[[seafloor.boulders]]
class = ""
per_hectare = 150
)",
                                  "scene", {}, {.scene_folder = folder.path()});
  const Seafloor whole = make_seafloor(scene.seafloor, scene.bed_seed(), scene.objects,
                                       scene.materials, {}, BedForm::grid);
  const Seafloor tiled = make_seafloor_in_tiles(scene.seafloor, scene.bed_seed(), scene.objects,
                                                scene.materials, {folder / "bed.tiles", "k"});
  CHECK(tiled.warnings.empty());
  CHECK(same_bytes(pings(scene, tiled, poses), pings(scene, whole, poses)));
  if (holes) return;  // which leave gaps in the numbers of the faces in tiles
  REQUIRE(tiled.faces == whole.faces);
  std::size_t differ = 0, painted = 0;
  for (std::uint32_t face = 0; face < whole.faces; ++face) {
    const Label& a = whole.labels[whole.label_of(face)];
    const Label& b = tiled.labels[tiled.label_of(face)];
    differ += whole.materials[a.sediment] != tiled.materials[b.sediment] ||
              whole.classes[a.class_id] != tiled.classes[b.class_id];
    painted += b.class_id != tiled.labels[0].class_id || b.sediment != tiled.labels[0].sediment;
  }
  CHECK(differ == 0);
  CHECK(painted > 20000);
}

TEST_CASE("A survey in tiles with smooth detail has the echoes that it has in memory") {
  const TemporaryFolder folder;
  constexpr std::uint32_t cells = 600;
  write_text(folder / "bed.tif", survey(cells, true).bytes());
  std::vector<Pose> poses;
  for (int i = 0; i < 6; ++i)
    poses.push_back({.position = {-11.6 + 0.4 * i, -11.6 + 0.4 * i, -8.0}});  // chunks' corner
  const Scene scene = parse_scene(
      scene_text("fan_scan") + "[seafloor.detail]\ncell_m = 0.125\nheight_at_1m_m = 0\n", "scene",
      {}, {.scene_folder = folder.path()});
  const std::vector<float> expected =
      pings(scene,
            make_seafloor(scene.seafloor, scene.bed_seed(), scene.objects, scene.materials, {},
                          BedForm::grid),
            poses);
  for (const char* surface : {"footprint", "refined"})
    CHECK(same_bytes(pings(scene,
                           make_seafloor_in_tiles(scene.seafloor, scene.bed_seed(), scene.objects,
                                                  scene.materials, {"", "k"}),
                           poses, surface),
                     expected));
}

TEST_CASE("A bed in tiles that rises above the sonar, or far below its depth, has all its echoes") {
  const TemporaryFolder folder;
  // Sound is fastest at the foot of the hollow.
  write_text(folder / "cast.csv", "depth_m,soundspeed_mps\n0,1450\n16,1450\n20,1540\n70,1540\n");
  struct Case {
    double near_m, rise_m, z_m;
    RefractionMode refraction;
  };
  const Case of = GENERATE(Case{30.0, 8.0, -12.0, RefractionMode::off},
                           Case{2.0, 2.5, -12.0, RefractionMode::off},
                           Case{8.0, -40.0, -10.0, RefractionMode::time_only});
  CAPTURE(of.rise_m);
  Scene scene = parse_scene(R"(version = 1
[seafloor]
extent_east_m = 200
extent_north_m = 60
cell_m = 0.5
depth_m = 15
[[seafloor.patches]]
material = "medium sand"
polygon_m = [[2, -30], [80, -30], [80, 30], [2, 30]]
border_m = 4
[sea]
profile = "cast.csv"
absorption_db_per_km = 30
[sonar.sidescan]
range_m = 80
bins = 400
elevations = 512
[run]
intersector = "fan_scan"
)",
                            "scene", {}, {.scene_folder = folder.path()});
  scene.seafloor.fractal.height_at_1m_m = 0.0;
  Patch& patch = scene.seafloor.seabed.patches.front();
  patch.rise_m = of.rise_m;
  patch.area.polygon_m.front().x() = patch.area.polygon_m.back().x() = of.near_m;
  scene.sea.refraction = of.refraction;
  Seafloor at_once =
      make_seafloor(scene.seafloor, scene.bed_seed(), {}, scene.materials, {}, BedForm::grid);
  Seafloor in_tiles =
      make_seafloor_in_tiles(scene.seafloor, scene.bed_seed(), {}, scene.materials, {});
  at_once.mean_bed_m = in_tiles.mean_bed_m;  // the speed of sound follows it
  const std::vector<Pose> poses = {{.position = {0.0, 0.0, of.z_m}}};
  CHECK(same_bytes(pings(scene, in_tiles, poses), pings(scene, at_once, poses)));
}

TEST_CASE("The check of a run finds no difference on a bed in tiles with relief") {
  Scene scene;
  scene.seafloor.extent_east_m = scene.seafloor.extent_north_m = 100.0;
  scene.seafloor.cell_m = 0.5;
  scene.seafloor.depth_m = 15.0;
  scene.seafloor.fractal.height_at_1m_m = GENERATE(0.02, 0.2);
  scene.sonars.front().range_m = 30.0;
  scene.sonars.front().elevations = 256;
  auto prepared = std::make_shared<PreparedSeafloor>();
  prepared->seafloor = make_seafloor_in_tiles(scene.seafloor, scene.bed_seed(), {}, {}, {});
  prepared->origin.surface = "footprint";
  Simulator simulator(scene, {.seafloor = prepared});
  for (int i = 0; i < 4; ++i) {
    const AgreementCounts counts =
        SimulatorInternals::verify(simulator, {.position = {7.3 * i, 5.1 * i, -9.0}});
    CHECK(counts.rays > 0);
    CHECK(counts.count(Verdict::unexplained) == 0);
  }
}

TEST_CASE("A bed needs tiles where it cannot be made at once") {
  SeafloorOptions options;
  options.cell_m = 1.0;
  options.extent_east_m = 100.0;
  const auto most_cells_to = [&](double& extent_m, double hurst) {
    options.fractal.hurst = hurst;
    extent_m = 100.0;
    while (!needs_tiles(options)) extent_m += 1.0;
    const double most = extent_m - 1.0;
    extent_m = 100.0;
    return most;
  };
  // doc/large_beds.md states these numbers. 2^29 numbers are a square of 23170, but FFTW gets only
  // lengths without prime factors above 5: the next one is 23040, two periods of the bed, or four.
  for (double* extent_m : {&options.extent_east_m, &options.extent_north_m}) {
    CHECK(most_cells_to(*extent_m, 0.7) == 0.5 * 23040 - 1);
    CHECK(most_cells_to(*extent_m, 0.71) == 0.25 * 23040 - 1);
  }
  options.extent_east_m = 7000.0;
  CHECK_THROWS_WITH(make_seafloor(options, 1),
                    Catch::Contains("too large to be made at once") &&
                        Catch::Contains("make seafloor.cell_m larger or the extent smaller"));
  // A layer of roughness is a field as large.
  options.fractal.height_at_1m_m = 0.0;
  CHECK_FALSE(needs_tiles(options));
  options.seabed.roughness.push_back({.relief = {.height_at_1m_m = 0.01, .hurst = 0.8}});
  CHECK(needs_tiles(options));
}

TEST_CASE("A bed in tiles must stay under water with its layers, whatever lies beyond its border") {
  SeafloorOptions options;  // of a tenth of a block of heights
  options.extent_east_m = options.extent_north_m = 50.0;
  options.cell_m = 0.5;
  options.fractal.height_at_1m_m = 0.1;
  const auto highest_m = [&](double depth_m) {
    options.depth_m = depth_m;
    const Seafloor bed = make_seafloor_in_tiles(options, 1, {}, {}, {});
    return double(ensonify::refine::bounds(bed.grid->mesh()).highest.z());
  };
  const double relief_m = highest_m(100.0) + 100.0;
  CHECK(highest_m(relief_m + 0.001) == Approx(-0.001).margin(1e-4));
  CHECK_THROWS_WITH(highest_m(relief_m - 0.001), Catch::Contains("above the sea surface"));
  options.seabed.pits.emplace_back().relief = {.per_hectare = 2000.0, .diameter_m = 2.0};
  REQUIRE(highest_m(100.0) + 100.0 < relief_m - 0.002);
  CHECK(highest_m(relief_m - 0.001) < 0.0);
}

TEST_CASE("What a bed in tiles cannot have is refused with what to do") {
  SeafloorOptions options;
  const auto make = [&] { return make_seafloor_in_tiles(options, 1, {}, {}, {}); };
  options.seabed.outcrops.emplace_back();
  CHECK_THROWS_WITH(make(), Catch::Contains("seafloor.outcrops.0"));
  options = {};
  Area& area = options.seabed.patches.emplace_back().area;
  area.shallowest_m = 500.0;
  const std::vector<std::string> warnings = make().warnings;
  CHECK(std::ranges::any_of(warnings, [](const std::string& warning) {
    return warning.find("seafloor.patches.0: at 64 places") == 0;
  }));
  area = {.radius_m = 10.0, .middle_east_m = 9000.0};
  CHECK_THROWS_WITH(make(), Catch::Contains("seafloor.patches.0: an area lies outside the seabed"));
  options = {};
  options.extent_east_m = options.extent_north_m = 1300.0;
  options.cell_m = 0.1;
  Scene scene;
  scene.seafloor = options;
  scene.run.surface = "static";
  CHECK_THROWS_WITH(prepare_seafloor(scene, {}), Catch::Contains("footprint"));
  scene.run.surface = "auto";
  scene.sea.refraction = RefractionMode::full;
  CHECK_THROWS_WITH(prepare_seafloor(scene, {}), Catch::Contains("time-only"));
}
