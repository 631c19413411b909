#include <chrono>
#include <random>
#include <thread>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/files.h"
#include "support/grids.h"
#include "support/program.h"
#include "support/tiny_scene.h"
#include "support/tree.h"

#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/refine/mesh_reader.h>

using namespace ensonify;
using namespace ensonify::tests;

namespace {

namespace fs = std::filesystem;

/// Larger than the tiny scene, so that its analysis and its file take some time.
std::string slow_scene() {
  std::string scene = tiny_scene;
  const std::string cell = "cell_m = 0.5";
  return scene.replace(scene.find(cell), cell.size(), "cell_m = 0.08");
}

/// The places of the corners of all faces.
std::vector<std::array<Eigen::Vector3f, 3>> corners_of(const fs::path& file) {
  const refine::TriangleMesh mesh = refine::read_mesh(file);
  std::vector<std::array<Eigen::Vector3f, 3>> corners;
  for (const refine::Face& face : mesh.faces)
    corners.push_back({mesh.positions[face[0]], mesh.positions[face[1]], mesh.positions[face[2]]});
  return corners;
}

}  // namespace

TEST_CASE("analyse writes a progressive mesh for a scene, from a scene and from a mesh") {
  const TemporaryFolder folder;
  write_text(folder / "s.toml", tiny_scene);
  const Outcome analysed =
      run_program(folder.path(), {"analyse", "s.toml", "-o", "bed.mesh", "--json"});
  REQUIRE(analysed.code == 0);
  const auto json = nlohmann::json::parse(analysed.out);
  CHECK(json.at("vertices") == 81 * 41);
  CHECK(json.at("faces") == 2 * 80 * 40);
  CHECK(json.at("bytes") == fs::file_size(folder / "bed.mesh"));

  const Outcome described = run_program(folder.path(), {"mesh-info", "bed.mesh"});
  INFO(described.err);
  REQUIRE(described.code == 0);
  CHECK(
      described.out.starts_with("vertices 3321\ntriangles 6400\nx_min -20\nx_max 20\ny_min -10\n"
                                "y_max 10\nz_min -"));
  CHECK(described.out.find("\nbase_vertices " +
                           std::to_string(json.at("base_vertices").get<int>()) + "\n") !=
        std::string::npos);
  CHECK(described.out.find("\nmade_from ") != std::string::npos);
  fs::copy_file(folder / "bed.mesh", folder / "cut.mesh");
  fs::resize_file(folder / "cut.mesh", fs::file_size(folder / "cut.mesh") / 2);
  CHECK(run_program(folder.path(), {"mesh-info", "cut.mesh"}).err.find("cut.mesh: ") !=
        std::string::npos);

  std::string scene = tiny_scene;
  const std::string bed = "extent_east_m = 40\nextent_north_m = 20\ncell_m = 0.5\n";
  scene.replace(scene.find(bed), bed.size(),
                "kind = \"progressive\"\nprogressive = \"bed.mesh\"\n");
  write_text(folder / "again.toml", scene);
  REQUIRE(run_program(folder.path(), {"run", "s.toml", "-o", "a", "--quiet"}).code == 0);
  const Outcome again = run_program(folder.path(), {"run", "again.toml", "-o", "b"});
  REQUIRE(again.code == 0);
  CHECK(again.err.find("surface: refined, because the seafloor was analysed before") !=
        std::string::npos);
  CHECK(read_text(folder / "a/left-right.png") == read_text(folder / "b/left-right.png"));

  REQUIRE(run_program(folder.path(), {"seafloor", "s.toml", "-o", "bed.ply"}).code == 0);
  REQUIRE(run_program(folder.path(), {"seafloor", "again.toml", "-o", "again.ply"}).code == 0);
  CHECK((corners_of(folder / "again.ply") == corners_of(folder / "bed.ply")));
  const Outcome mesh = run_program(
      folder.path(), {"analyse", "bed.ply", "-o", "mesh.mesh", "-D", "seafloor.material=silt"});
  REQUIRE(mesh.code == 0);
  CHECK(engine::open_analysed(folder / "mesh.mesh").materials.at(1) == "silt");

  const auto refused = [&](std::vector<std::string> arguments, const std::string& message,
                           int code = 2) {
    const auto before = tree_of(folder.path()).size();
    const Outcome outcome = run_program(folder.path(), std::move(arguments));
    CHECK(outcome.code == code);
    INFO(outcome.err);
    CHECK(outcome.err.find(message) != std::string::npos);
    CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
    CHECK(tree_of(folder.path()).size() == before);
  };
  refused({"analyse", "again.toml", "-o", "c.mesh"}, "its seafloor is already analysed");
  refused({"seafloor", "again.toml", "-o", "c.npy", "--quiet"}, "has no grid of heights");
  refused({"analyse", "none.ply", "-o", "c.mesh"}, "none.ply: there is no such file");
  refused({"analyse", "none.toml", "-o", "c.mesh"}, "none.toml");
  refused({"analyse", "s.toml", "-o", "none/c.mesh"}, "none/c.mesh", 1);
}

TEST_CASE("a survey that was analysed lies where the survey lies") {
  // UTM, and the equal-area map of Europe, which is no zone of UTM: both at 52 N, 10 E.
  struct Map {
    std::uint16_t epsg;
    double west_m, north_m;
  };
  const auto [epsg, west_m, north_m] =
      GENERATE(Map{32632, 568600.0, 5761550.0}, Map{3035, 4320950.0, 3210050.0});
  CAPTURE(epsg);
  const TemporaryFolder folder;
  Tiff survey;
  survey.columns = survey.rows = 101;
  survey.transform = {west_m, 1, 0, north_m, 0, -1};
  survey.epsg = epsg;
  for (int i = 0; i < 101 * 101; ++i)
    survey.heights.push_back(-20.0f + 0.3f * static_cast<float>(i % 7));
  write_text(folder / "survey.tif", survey.bytes());
  write_text(folder / "track.csv", "t_s,lat_deg,lon_deg\n0,52.0000,10.0000\n9,52.0001,10.0001\n");
  const auto scene = [](const std::string& bed) {
    return "version = 1\n[seafloor]\n" + bed +
           "[track]\nkind = \"file\"\nfile = \"track.csv\"\naltitude_m = 8\nping_interval_s = 1\n"
           "[sonar.s]\nrange_m = 15\nbins = 100\nelevations = 128\n[output]\nxtf = true\n"
           "[run]\nsurface = \"refined\"\n";
  };
  write_text(folder / "survey.toml", scene("kind = \"survey\"\nsurvey = \"survey.tif\"\n"));
  write_text(folder / "again.toml", scene("kind = \"progressive\"\nprogressive = \"bed.mesh\"\n"));
  const auto program = [&](std::vector<std::string> arguments) {
    const Outcome outcome = run_program(folder.path(), std::move(arguments));
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return outcome.out;
  };
  program({"analyse", "survey.toml", "-o", "bed.mesh"});
  const auto run = [&](const std::string& name) {
    program({"run", name + ".toml", "-o", name, "--quiet"});
    return nlohmann::json::parse(read_text(folder / name / "manifest.json")).at("reference");
  };
  CHECK(run("survey") == run("again"));
  for (const char* file : {"s_pings.csv", "s.xtf", "s.png"})
    CHECK((read_text(folder / "survey" / file) == read_text(folder / "again" / file)));
  CHECK(program({"mosaic", "survey", "again", "-o", "m.tif", "--quiet"}) ==
        program({"mosaic", "survey", "-o", "m.tif", "--quiet"}));

  program({"seafloor", "survey.toml", "-o", "bed.ply"});
  const auto bounds = [&](const std::string& file) {
    const std::string about = program({"mesh-info", file});
    const std::size_t begin = about.find("x_min");
    const std::size_t end = about.find('\n', about.find("z_max"));
    return about.substr(begin, end - begin);
  };
  CHECK(bounds("bed.mesh") == bounds("bed.ply"));
  CHECK_THAT(bounds("bed.mesh"),
             Catch::StartsWith("x_min " + std::to_string(static_cast<int>(west_m)) + ".5\n"));
}

TEST_CASE("two processes that build the same seafloor leave one good file") {
  const TemporaryFolder folder;
  write_text(folder / "s.toml", slow_scene());
  const auto go = [&](const std::string& name) {
    return run_program(folder.path(), {"run", "s.toml", "-o", name, "--quiet", "--surface",
                                       "refined", "--cache", "cache", "--threads", "1"});
  };
  REQUIRE(go("expected").code == 0);
  const auto expected = tree_of(folder / "expected");
  const auto good = tree_of(folder / "cache");
  REQUIRE(good.size() == 1);
  for (int round = 0; round < 3; ++round) {
    fs::remove_all(folder / "cache");
    std::array<int, 2> codes{};
    std::thread other([&] { codes[1] = go("b").code; });
    codes[0] = go("a").code;
    other.join();
    CHECK(codes == std::array{0, 0});
    CHECK((tree_of(folder / "a") == expected));
    CHECK((tree_of(folder / "b") == expected));
    CHECK((tree_of(folder / "cache") == good));
  }
}

TEST_CASE("a run that is killed at any moment leaves no bad seafloor in its cache") {
  const TemporaryFolder folder;
  write_text(folder / "s.toml", slow_scene());
  const auto arguments = [](const std::string& name) {
    return std::vector<std::string>{"run",     "s.toml", "-o",        name,     "--quiet",
                                    "--cache", "cache",  "--surface", "refined"};
  };
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  REQUIRE(run_program(folder.path(), arguments("expected")).code == 0);
  const std::chrono::duration<double> whole = Clock::now() - start;
  const auto expected = tree_of(folder / "expected");
  const auto good = tree_of(folder / "cache");
  std::mt19937 random(5);
  int killed = 0;
  for (int round = 0; round < 30; ++round) {
    fs::remove_all(folder / "cache");
    const auto outcome = run_program(folder.path(), arguments("killed"), {}, [&](pid_t process) {
      std::this_thread::sleep_for(whole *
                                  std::uniform_real_distribution<double>(0.05, 0.9)(random));
      kill(process, SIGKILL);
    });
    killed += outcome.code == -SIGKILL;
    if (fs::exists(folder / "cache"))
      for (const auto& [name, bytes] : tree_of(folder / "cache"))
        if (name.ends_with(".mesh")) CHECK((bytes == good.at(name)));
  }
  CHECK(killed > 10);
  const Outcome after = run_program(folder.path(), arguments("after"));
  CHECK(after.code == 0);
  CHECK(after.err == "");
  CHECK((tree_of(folder / "after") == expected));
}
