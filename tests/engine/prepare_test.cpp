#include <ensonify/engine/simulator/prepare.h>

#include <chrono>
#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "support/catch.h"
#include "support/files.h"
#include "support/mesh_files.h"
#include "support/program.h"
#include "support/temporary_folder.h"
#include "support/tree.h"

#include <ensonify/engine/output/png.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/simulate.h>
#include <ensonify/engine/simulator/seafloor_cache.h>
#include <ensonify/refine/atomic_file.h>
#include <ensonify/refine/mesh_reader.h>
#include <ensonify/refine/progressive_mesh_file.h>

using namespace ensonify;
using namespace ensonify::engine;
using ensonify::tests::tree_of;
using tests::read_text;
using tests::TemporaryFolder;
using tests::write_text;

namespace {

namespace fs = std::filesystem;

Scene refined_scene() {
  Scene scene;
  scene.seafloor.extent_east_m = 60.0;
  scene.seafloor.extent_north_m = 30.0;
  scene.seafloor.cell_m = 0.25;
  scene.track.pings = 20;
  scene.track.altitude_m = 6.0;
  scene.run.surface = "refined";
  scene.run.block_pings = 5;
  scene.sonars.front().range_m = 25.0;
  scene.sonars.front().bins = 120;
  scene.sonars.front().elevations = 200;
  return scene;
}

/// The same bed with a box on it, from a file.
Scene scene_with_object(const fs::path& folder) {
  Scene scene = refined_scene();
  const fs::path file = folder / "box.ply";
  refine::TriangleMesh box;
  for (int i = 0; i < 8; ++i)
    box.positions.emplace_back(i & 1 ? 1.0f : -1.0f, i & 2 ? 1.0f : -1.0f, i & 4 ? 2.0f : 0.0f);
  box.faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
               {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  refine::write_ply(file, box);
  ObjectOptions object;
  object.mesh = {"box.ply", file};
  object.class_name = "box";
  object.material = "steel";
  object.east_m = 8.0;
  scene.objects.push_back(object);
  return scene;
}

/// The scene with other values of a key: the ends of a range, every word of a list, the other
/// truth.
std::vector<Scene> with_other_values(const Scene& scene, const Key<Scene>& key) {
  std::vector<Scene> others;
  const auto set = [&](const auto& value) {
    using Value = std::decay_t<decltype(value)>;
    others.push_back(scene);
    *std::get<Value*>(key.option(others.back())) = value;
  };
  std::visit(
      [&]<class Value>(const Value* value) {
        if constexpr (std::is_same_v<Value, bool>) {
          set(!*value);
        } else if constexpr (std::is_enum_v<Value>) {
          for (std::size_t i = 0; i < key.choices.size(); ++i) set(static_cast<Value>(i));
        } else if constexpr (std::is_same_v<Value, std::string>) {
          for (const std::string_view word : key.choices) set(std::string(word));
        } else if constexpr (std::is_same_v<Value, int> || std::is_same_v<Value, double>) {
          for (const double end : {key.range.low, key.range.high}) set(static_cast<Value>(end));
        }
      },
      key.option(scene));
  return others;
}

std::map<std::string, std::string> run_into(const fs::path& folder, const Scene& scene,
                                            const fs::path& cache, RunReport* report = nullptr) {
  RunReport did = run(scene, folder, {.threads = 2, .cache = cache});
  if (report) *report = did;
  return tree_of(folder);
}

}  // namespace

TEST_CASE("a seafloor's key follows its options, its files and the seed, and nothing else") {
  const TemporaryFolder folder;
  const Scene scene = scene_with_object(folder.path());
  const std::string key = seafloor_key(scene);
  CHECK(key.size() == 32);
  const auto key_with = [&](auto&& change) {
    Scene other = scene;
    change(other);
    return seafloor_key(other);
  };
  CHECK(key_with([](Scene& s) { s.track.pings = 7; }) == key);
  CHECK(key_with([](Scene& s) { s.sonars.front().range_m = 7; }) == key);
  CHECK(key_with([](Scene& s) { s.run.surface = "static"; }) == key);
  CHECK(key_with([](Scene& s) { s.seed = 2; }) != key);
  CHECK(key_with([](Scene& s) { s.seafloor.cell_m = 0.2501; }) != key);
  CHECK(key_with([](Scene& s) { s.seafloor.fractal.hurst = 0.71; }) != key);
  CHECK(key_with([](Scene& s) { s.seafloor.ripples.rms_height_m = 0.01; }) != key);
  CHECK(key_with([](Scene& s) { s.seafloor.material = "silt"; }) != key);
  CHECK(key_with([](Scene& s) { s.objects.front().east_m = 8.5; }) != key);
  CHECK(key_with([](Scene& s) { s.objects.front().class_name = "crate"; }) != key);
  CHECK(key_with([](Scene& s) { s.objects.clear(); }) != key);
  CHECK(key_with([](Scene& s) { s.seafloor.seabed.patches.emplace_back(); }) != key);
  CHECK(key_with([](Scene& s) { s.seafloor.seabed.bedforms.emplace_back(); }) != key);
  const std::string box = read_text(folder / "box.ply");
  write_text(folder / "box.ply", box + "\n");
  CHECK(seafloor_key(scene) != key);
  const auto key_with_box = [&](const fs::path& file) {
    write_text(file, box);
    return key_with([&](Scene& s) { s.objects.front().mesh.path = file; });
  };
  fs::create_directory(folder / "elsewhere");
  CHECK(key_with_box(folder / "elsewhere/box.ply") == key);
  CHECK(key_with_box(folder / "other.ply") != key);  // warnings have the file's name
}

TEST_CASE("a seafloor's key follows what lies beside its survey and its images") {
  const TemporaryFolder folder;
  write_text(folder / "bed.asc",
             "ncols 3\nnrows 2\nxllcorner 1\nyllcorner 2\ncellsize 2\n-9 -9 -9\n-9 -9 -9\n");
  Scene scene;
  scene.seafloor.kind = SeafloorKind::survey;
  scene.seafloor.survey = {"bed.asc", folder / "bed.asc"};
  const std::string without = seafloor_key(scene);
  CHECK(seafloor_key(scene) == without);
  write_text(folder / "bed.prj",
             "PROJCS[\"local\",GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,"
             "298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],"
             "PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"latitude_of_origin\",54],"
             "PARAMETER[\"central_meridian\",10],PARAMETER[\"scale_factor\",1],"
             "PARAMETER[\"false_easting\",0],PARAMETER[\"false_northing\",0],UNIT[\"metre\",1]]");
  const std::string with_reference = seafloor_key(scene);
  CHECK(with_reference != without);
  // An image may be placed by a file beside it, too.
  const std::vector<std::byte> image = encode_png({.width = 2, .height = 1, .pixels = {1, 2}});
  write_text(folder / "map.png", {reinterpret_cast<const char*>(image.data()), image.size()});
  scene.seafloor.seabed.patches.emplace_back().area.image = {"map.png", folder / "map.png"};
  std::set<std::string> keys{without, with_reference, seafloor_key(scene)};
  for (const char* const place : {"0", "2"}) {
    write_text(folder / "map.pgw", std::string("9\n0\n0\n-9\n") + place + "\n9\n");
    keys.insert(seafloor_key(scene));
  }
  // Or a scene has its pixels in memory.
  for (const std::uint8_t pixel : {1, 2}) {
    scene.seafloor.seabed.patches.front().area.pixels =
        std::make_shared<const AreaPixels>(AreaPixels{2, 1, {1, pixel}});
    keys.insert(seafloor_key(scene));
  }
  CHECK(keys.size() == 7);
}

TEST_CASE("a run's warnings name its own mesh files, whatever another run has cached") {
  const TemporaryFolder folder;
  Scene scene = scene_with_object(folder.path());
  const bool as_bed = GENERATE(false, true);
  CAPTURE(as_bed);
  refine::TriangleMesh mesh =
      as_bed ? refine::TriangleMesh{{{-40, -20, -9}, {40, -20, -9}, {40, 20, -9}, {-40, 20, -9}},
                                    {{0, 1, 2}, {0, 2, 3}}}
             : refine::read_mesh(folder / "box.ply");
  mesh.faces.push_back(mesh.faces.front());  // is removed, with a warning
  const auto scene_with = [&](const std::string& name) {
    refine::write_ply(folder / name, mesh);
    Scene with = scene;
    if (as_bed) with.seafloor.kind = SeafloorKind::mesh;
    (as_bed ? with.seafloor.mesh : with.objects.front().mesh) = InputFile{name, folder / name};
    return with;
  };
  const Scene a = scene_with("a.ply"), b = scene_with("b.ply");
  RunReport report;
  const auto expected = run_into(folder / "expected", b, "", &report);
  CHECK_THAT(report.warnings.front(), Catch::StartsWith("b.ply: repaired: "));
  run_into(folder / "a", a, folder / "cache");
  CHECK((run_into(folder / "b", b, folder / "cache") == expected));
}

TEST_CASE("a run's bytes are the same without a cache, with a cold one and with a warm one") {
  const TemporaryFolder folder;
  for (const bool object : {false, true}) {
    const Scene scene = object ? scene_with_object(folder.path()) : refined_scene();
    const std::string name = object ? "object" : "bed";
    const fs::path cache = folder / (name + "-cache");
    const auto expected = run_into(folder / (name + "-none"), scene, "");
    RunReport cold, warm;
    CHECK((run_into(folder / (name + "-cold"), scene, cache, &cold) == expected));
    CHECK(!cold.origin.cached);
    CHECK(cold.origin.cache_file == cache / (seafloor_key(scene) + ".mesh"));
    CHECK((run_into(folder / (name + "-warm"), scene, cache, &warm) == expected));
    CHECK(warm.origin.cached);
    CHECK(warm.warnings == cold.warnings);
    CHECK(tree_of(cache).size() == 1);

    // The manifest names the surface; nothing else may differ.
    Scene whole = scene;
    whole.run.surface = "static";
    auto by_static = run_into(folder / (name + "-static"), whole, cache);
    CHECK((by_static.at("sidescan.png") == expected.at("sidescan.png")));
    CHECK(by_static.at("sidescan_pings.csv") == expected.at("sidescan_pings.csv"));
  }
}

TEST_CASE(
    "a cached seafloor that is damaged or belongs to another scene is noticed and made again") {
  const TemporaryFolder folder;
  const Scene scene = scene_with_object(folder.path());
  const fs::path cache = folder / "cache";
  RunReport report;
  const auto expected = run_into(folder / "first", scene, cache, &report);
  const fs::path file = report.origin.cache_file;
  const std::string good = read_text(file);

  const auto check_rebuilt = [&](const std::string& bad) {
    write_text(file, bad);
    CHECK((run_into(folder / "again", scene, cache, &report) == expected));
    CHECK((read_text(file) == good));
    CHECK(tree_of(cache).size() == 1);
    return report.warnings.size();
  };
  const std::size_t warnings = report.warnings.size();
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{100},
                                 std::size_t{4096}, good.size() / 2, good.size() - 1})
    CHECK(check_rebuilt(good.substr(0, size)) == warnings + 1);
  // Damage that is found when the file is opened, in the middle of the run, or never.
  int noticed = 0;
  for (std::size_t i = 0; i < 24; ++i) {
    std::string bad = good;
    bad[bad.size() * i / 24 + 17] ^= 0x10;
    write_text(file, bad);
    CHECK((run_into(folder / "again", scene, cache, &report) == expected));
    noticed += report.warnings.size() > warnings;
    if (report.warnings.size() > warnings) CHECK((read_text(file) == good));
  }
  CHECK(noticed > 12);

  Scene other = scene;
  other.seed = 99;
  run(other, folder / "other", {.cache = cache});
  fs::rename(cache / (seafloor_key(other) + ".mesh"), file);
  CHECK((run_into(folder / "again", scene, cache, &report) == expected));
  CHECK(report.warnings.size() == warnings + 1);
  CHECK((read_text(file) == good));
}

TEST_CASE("a cache that cannot be written is a warning") {
  const TemporaryFolder folder;
  write_text(folder / "file", "");
  const Scene scene = refined_scene();
  const auto expected = run_into(folder / "none", scene, "");
  RunReport report;
  CHECK((run_into(folder / "run", scene, folder / "file/cache", &report) == expected));
  REQUIRE(!report.warnings.empty());
  CHECK_THAT(report.warnings.back(),
             Catch::StartsWith((folder / "file/cache").string() + ": cannot make this folder") &&
                 Catch::Contains("Not a directory") && Catch::Contains("seafloor is not kept") &&
                 Catch::Contains("--cache"));
  CHECK(report.origin.cache_file.empty());
  const Simulator session(scene, {.cache = folder / "file/cache"});
  REQUIRE(!session.warnings().empty());
  CHECK_THAT(session.warnings().front(), Catch::Contains("--cache names another folder"));
}

TEST_CASE("values of a scene of which no seafloor can be made are a SceneError") {
  Scene scene = refined_scene();
  scene.seafloor.fractal.height_at_1m_m = 5.0;
  scene.seafloor.depth_m = 2.0;
  for (const char* surface : {"auto", "static", "refined", "footprint"}) {
    scene.run.surface = surface;
    CHECK_THROWS_AS(Simulator(scene), SceneError);
    CHECK_THROWS_WITH(Simulator(scene), Catch::Contains(" m above the sea surface"));
  }
}

TEST_CASE("a fault of an object or of a layer has its key, and its place in the scene's file") {
  const TemporaryFolder folder;
  scene_with_object(folder.path());  // writes box.ply
  const auto fault_of = [&](const std::string& table) {
    const Scene scene = parse_scene(
        "version = 1\n[seafloor]\nextent_east_m = 30\nextent_north_m = 30\ncell_m = 0.5\n" + table,
        "s.toml", {}, {.scene_folder = folder.path(), .data_folder = {}});
    try {
      prepare_seafloor(scene, {});
    } catch (const SceneError& error) {
      return error;
    }
    return SceneError("no fault");
  };
  const std::string steel = "material = \"steel\"\n";
  const auto check = [&](const std::string& table, const std::string& key,
                         const std::string& what) {
    const SceneError error = fault_of(table);
    CHECK(error.key == key);
    CHECK_THAT(error.what(), Catch::StartsWith("s.toml:6:1: ") && Catch::Contains(what));
  };
  check("[[objects]]\nshape = \"box\"\neast_m = 99\n" + steel, "objects.0",
        ": objects.0 (box): there is no bed below this object");
  check("[[objects]]\nmesh = \"box.ply\"\neast_m = 99\n" + steel, "objects.0",
        "box.ply: there is no bed below this object");
  check("[[seafloor.patches]]\nmaterial = \"silt\"\nshallowest_m = 500\n", "seafloor.patches.0",
        ": seafloor.patches.0: an area has depths");
}

TEST_CASE("trimming the cache keeps what was just saved") {
  const TemporaryFolder folder;
  const fs::path cache = folder / "cache";
  fs::create_directories(cache);
  // Clocks may be set back. A file counts with what it takes on the disk, without its holes.
  write_text(cache / "huge.mesh", std::string(32 << 20, 'x'));
  fs::last_write_time(cache / "huge.mesh",
                      fs::file_time_type::clock::now() + std::chrono::hours(2));
  write_text(cache / "holes.mesh", "");
  fs::resize_file(cache / "holes.mesh", std::uintmax_t{17} << 30);
  fs::last_write_time(cache / "holes.mesh",
                      fs::file_time_type::clock::now() + std::chrono::hours(3));
  const auto prepared =
      prepare_seafloor(refined_scene(), {.cache = cache, .cache_limit_bytes = 16 << 20});
  CHECK(prepared->warnings.empty());
  CHECK(fs::exists(prepared->origin.cache_file));
  CHECK(!fs::exists(cache / "huge.mesh"));
  CHECK(fs::exists(cache / "holes.mesh"));
}

TEST_CASE("the cache loses what killed processes left half-written, and nothing of living ones") {
  const TemporaryFolder folder;
  refine::NewFile slow(folder / "slow.mesh");
  fs::last_write_time(slow.temporary(), fs::file_time_type::clock::now() - std::chrono::hours(48));
  write_text(folder / ".killed.mesh.0.tmp", "half");
  trim_cache(folder.path(), 1 << 20, "none");
  CHECK(!fs::exists(folder / ".killed.mesh.0.tmp"));
  slow.commit();
  CHECK(fs::exists(folder / "slow.mesh"));
}

TEST_CASE("surface auto means footprint for a bed of heights, which is not analysed or cached") {
  const TemporaryFolder folder;
  Scene scene = refined_scene();
  scene.run.intersector = "embree";
  for (const char* surface : {"auto", "footprint"}) {
    scene.run.surface = surface;
    scene.track.pings = 37;
    const auto prepared = prepare_seafloor(scene, {.cache = folder / "cache"});
    CHECK(prepared->origin.surface == "footprint");
    CHECK(prepared->origin.why.empty() == (scene.run.surface != "auto"));
    CHECK(prepared->seafloor.grid);
    CHECK(!prepared->seafloor.progressive);
    CHECK(prepared->seafloor.mesh.faces.empty());
    CHECK(prepared->origin.cache_file.empty());
  }
  scene.run.surface = "auto";
  scene.track.pings = 38;
  auto prepared = prepare_seafloor(scene, {.cache = folder / "cache"});
  CHECK(prepared->origin.surface == "static");
  CHECK(prepared->origin.why == "38 pings are enough for a tree over 57600 faces to save time");
  CHECK(!prepared->seafloor.grid);
  CHECK(prepared->seafloor.mesh.faces.size() == prepared->seafloor.faces);
  scene.run.intersector = "fan_scan";  // has no tree
  prepared = prepare_seafloor(scene, {.cache = folder / "cache"});
  CHECK(prepared->origin.surface == "footprint");
  CHECK(!fs::exists(folder / "cache"));
}

TEST_CASE("surface auto of a mesh means refined unless the run is too short, and says why") {
  const TemporaryFolder folder;
  Scene scene = refined_scene();
  scene.run.surface = "auto";
  scene.seafloor.cell_m = 0.1;  // 360,000 faces
  refine::write_ply(folder / "bed.ply", make_seafloor(scene.seafloor, scene.seed).mesh);
  scene.seafloor.kind = SeafloorKind::mesh;
  scene.seafloor.mesh = {"bed.ply", folder / "bed.ply"};
  scene.track.pings = 100;
  auto prepared = prepare_seafloor(scene, {});
  CHECK(prepared->origin.surface == "refined");
  CHECK(prepared->seafloor.progressive);
  CHECK(prepared->seafloor.mesh.faces.empty());
  CHECK(prepared->origin.why ==
        "100 pings are enough for the analysis of 360000 faces to save time");
  scene.track.pings = 3;
  prepared = prepare_seafloor(scene, {});
  CHECK(prepared->origin.surface == "static");
  CHECK(!prepared->seafloor.progressive);
  CHECK(prepared->seafloor.mesh.faces.size() == 360000);
  CHECK(prepared->origin.why ==
        "3 pings are too few for the analysis of 360000 faces to save time");
  scene.run.surface = "footprint";
  prepared = prepare_seafloor(scene, {});
  CHECK(prepare_seafloor(scene, {.seafloor = prepared}) == prepared);
  CHECK(prepared->origin.surface == "footprint");
  CHECK(prepared->origin.why.empty());
  CHECK(prepared->seafloor.progressive);
}

TEST_CASE("every key outside the seafloor's that changes its preparation changes its key, too") {
  const TemporaryFolder folder;
  Scene scene = refined_scene();
  scene.seafloor.cell_m = 0.5;  // 14,400 faces
  scene.run = {.surface = "auto", .intersector = "embree"};
  SECTION("a bed of heights") { scene.track.pings = 10; }
  SECTION("a mesh") {
    refine::write_ply(folder / "bed.ply", make_seafloor(scene.seafloor, scene.seed).mesh);
    scene.seafloor.kind = SeafloorKind::mesh;
    scene.seafloor.mesh = {"bed.ply", folder / "bed.ply"};
    scene.track.pings = 1;
  }
  const SeafloorOrigin before = prepare_seafloor(scene, {})->origin;
  REQUIRE(before.surface == "static");
  std::set<std::string> changing;
  for (const Section<Scene>& section : scene_sections()) {
    if (section.name.starts_with("seafloor")) continue;
    for (const Key<Scene>& key : section.keys)
      for (const Scene& other : with_other_values(scene, key)) {
        const SeafloorOrigin after = prepare_seafloor(other, {})->origin;
        if (after.surface == before.surface && after.why == before.why) continue;
        CAPTURE(section.name, key.name, after.surface, after.why);
        CHECK(preparation_key(other) != preparation_key(scene));
        changing.insert(std::string(section.name) + "." + std::string(key.name));
      }
  }
  for (const char* known : {"run.surface", "track.kind", "track.pings"})
    CHECK(changing.contains(known));
  CHECK(preparation_key(scene) == preparation_key(Scene(scene)));
}

TEST_CASE("a scene may name an analysed seafloor, which has its bed, objects and labels") {
  const TemporaryFolder folder;
  const Scene source = scene_with_object(folder.path());
  Seafloor seafloor = make_seafloor(source.seafloor, source.seed, source.objects);
  const refine::TriangleMesh mesh = seafloor.mesh;
  std::vector<std::uint16_t> labels;
  for (std::uint32_t face = 0; face < mesh.faces.size(); ++face)
    labels.push_back(seafloor.label_of(face));
  analyse(seafloor, 1);
  save_analysed(seafloor, seafloor_key(source), folder / "bed.mesh");

  const Seafloor again = open_analysed(folder / "bed.mesh");
  CHECK(again.vertices == mesh.positions.size());
  CHECK(again.faces == mesh.faces.size());
  CHECK(again.bed_faces == seafloor.bed_faces);
  CHECK(again.mean_bed_m == seafloor.mean_bed_m);
  CHECK(again.classes == seafloor.classes);
  CHECK(again.materials == seafloor.materials);
  CHECK(again.bounds().lowest == refine::bounds(mesh).lowest);
  CHECK(again.bounds().highest == refine::bounds(mesh).highest);
  for (std::uint32_t face = 0; face < mesh.faces.size(); ++face)
    REQUIRE(again.label_of(face) == labels[face]);
  REQUIRE(again.object_meshes.size() == 1);
  CHECK(again.object_meshes[0].positions == seafloor.object_meshes[0].positions);
  CHECK(again.object_meshes[0].place == seafloor.object_meshes[0].place);
  const std::string_view about = again.progressive->about();
  refine::save(*again.progressive, {.tags = labels, .about = about.substr(0, about.find('\0'))},
               folder / "old.mesh");
  CHECK_THROWS_WITH(open_analysed(folder / "old.mesh"),
                    Catch::Contains("the shapes of its objects") && Catch::Contains("again"));
  Seafloor restored = again;
  restore_mesh(restored);
  CHECK(restored.face_label == labels);
  const refine::TriangleMesh& whole = restored.mesh;
  REQUIRE(whole.faces.size() == mesh.faces.size());
  for (std::size_t face = 0; face < mesh.faces.size(); ++face)
    for (std::size_t k = 0; k < 3; ++k)
      REQUIRE(whole.positions[whole.faces[face][k]] == mesh.positions[mesh.faces[face][k]]);

  Scene scene = source;
  scene.seafloor = {};
  scene.seafloor.kind = SeafloorKind::progressive;
  scene.seafloor.progressive = {"bed.mesh", folder / "bed.mesh"};
  scene.objects.clear();
  const auto expected = run_into(folder / "source", source, "");
  for (const char* surface : {"auto", "static", "refined", "footprint"}) {
    scene.run.surface = surface;
    const auto found = run_into(folder / surface, scene, "");
    CAPTURE(surface);
    CHECK((found.at("sidescan.png") == expected.at("sidescan.png")));
    CHECK(found.at("sidescan_pings.csv") == expected.at("sidescan_pings.csv"));
  }
  scene.objects = source.objects;
  CHECK_THROWS_AS(prepare_seafloor(scene, {}), SceneError);

  write_text(folder / "bed.mesh", read_text(folder / "bed.mesh").substr(0, 5000));
  scene.objects.clear();
  CHECK_THROWS_AS(prepare_seafloor(scene, {}), refine::MeshError);
}
