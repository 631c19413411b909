#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/tiny_scene.h"

#include <ensonify/engine/trace/intersector.h>
#include <ensonify/refine/progressive_mesh_file.h>

using namespace ensonify;
using namespace ensonify::tests;
namespace fs = std::filesystem;

namespace {

/// Replaces the analysed seafloor in a file by one whose bounding spheres are a fifth too small:
/// the file is valid, but refinement misses faces.
void shrink_spheres(const fs::path& file) {
  const refine::ProgressiveMesh sound = refine::map_progressive_mesh(file);
  sound.verify_all();
  const auto copy = [](auto span) { return std::vector(span.begin(), span.end()); };
  refine::ProgressiveMeshArrays arrays;
  arrays.points = copy(sound.points);
  arrays.mid = copy(sound.mid);
  arrays.spheres = copy(sound.spheres);
  arrays.order = copy(sound.order);
  arrays.faces = copy(sound.faces);
  arrays.source_face = copy(sound.source_face);
  arrays.roots = copy(sound.roots);
  arrays.world_origin = sound.world_origin;
  for (refine::Sphere& sphere : arrays.spheres) sphere.radius *= 0.8f;
  std::vector<std::uint16_t> tags;
  for (std::uint32_t face = 0; face < sound.tag_count(); ++face) tags.push_back(sound.tag(face));
  const std::string about(sound.about()), key(sound.key());
  refine::save(refine::ProgressiveMesh(std::move(arrays)), {tags, about, key}, file);
}

}  // namespace

TEST_CASE("check compares every intersector with the reference, and finds nothing unexplained",
          "[slow]") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const auto check = [&](std::vector<std::string> more, const char* rays = "1e4") {
    more.insert(more.begin(), {"check", "tiny.toml", "--quiet", "--rays", rays});
    return run_program(folder.path(), more);
  };
  const Outcome table = check({"--threads", "1"});
  INFO(table.err);
  CHECK(table.code == 0);
  CHECK(table.err.empty());
  CHECK(table.out.starts_with("surface,intersector,source,rays,same,tie,end,edge,leak,coplanar,"));
  for (const auto& kind : ensonify::engine::intersector_kinds())
    CHECK(table.out.find("\nstatic," + std::string(kind.name) + ",scene,") != std::string::npos);
  CHECK(check({"--threads", "3"}).out == table.out);
  CHECK(check({"-D", "seed=2"}).out != table.out);

  const Outcome json = check({"--json"}, "3e4");
  CHECK(json.code == 0);
  const auto report = nlohmann::json::parse(json.out);
  CHECK(report["reference"] == "pluecker");
  CHECK(report["unexplained"] == 0);
  CHECK(report["times_s"]["compare"] > 0.0);
  std::uint64_t scene_rays = 0;
  for (const auto& row : report["rows"]) {
    std::uint64_t judged = 0;
    for (const auto* verdict : {"same", "tie", "end", "edge", "leak", "coplanar", "unexplained"})
      judged += row[verdict].get<std::uint64_t>();
    CHECK(judged == row["rays"]);
    if (row["intersector"] == "embree" && row["source"] == "scene") scene_rays = row["rays"];
    if (row["intersector"] == "pluecker") CHECK(row["same"] == row["rays"]);
  }
  for (const char* source : {"scene", "aimed_fans", "bodies", "plumb_lines", "faces"})
    CHECK(std::ranges::count(report["rows"], source,
                             [](const auto& row) { return row["source"]; }) > 0);
  for (const auto& row : report["rows"]) {
    CHECK(row["over_limit"].empty());
    CHECK(row["limits"].empty() ==
          (row["intersector"] == "pluecker" || row["intersector"] == "brute_force" ||
           row["intersector"] == "progressive_mesh"));
  }
  CHECK(scene_rays >= 15000);  // more than the track's pings give: the track is repeated
}

TEST_CASE("check compares the wide fan of a sonar that looks ahead, bent or not") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", std::string(tiny_scene) + R"([sonar.ahead]
kind = "imaging"
range_m = 12
bins = 100
beams = 64
elevations = 32
sector_low_deg = 10
sector_high_deg = 80
)");
  write_text(folder / "cast.csv", "depth_m,soundspeed_mps\n0,1520\n4,1520\n7,1490\n60,1490\n");
  for (const char* refraction : {"off", "full"}) {
    const Outcome outcome = run_program(
        folder.path(), {"check", "tiny.toml", "--quiet", "--rays", "1e4", "--json", "--intersector",
                        "embree,fan_scan", "-D", "sea.profile=cast.csv", "-D",
                        std::string("sea.refraction=") + refraction});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    CHECK(nlohmann::json::parse(outcome.out)["unexplained"] == 0);
  }
}

TEST_CASE("check compares the bent rays of a scene with a cast on every surface") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  write_text(folder / "cast.csv", "depth_m,soundspeed_mps\n0,1520\n4,1520\n7,1490\n60,1490\n");
  const auto check = [&](const std::string& refraction) {
    const Outcome outcome = run_program(
        folder.path(), {"check", "tiny.toml", "--quiet", "--rays", "3e4", "--json", "-D",
                        "sea.profile=cast.csv", "-D", "sea.refraction=" + refraction});
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    return nlohmann::json::parse(outcome.out);
  };
  const auto report = check("full");
  CHECK(report["unexplained"] == 0);
  CHECK(report["bent_every"] == 1);
  int rows = 0;
  for (const auto& row : report["rows"]) {
    if (row["source"] != "bent") continue;
    ++rows;
    CHECK(row["rays"] > 15000);
    CHECK(row["same"] >= 0.995 * row["rays"].get<double>());
    CHECK(row["over_limit"].empty());
    CHECK(row["limits"]["edge"] == 5e-3);
    CHECK(row["largest_dt_m"] > 0.0);
    CHECK(row["largest_dt_m"] < 1e-4);
  }
  CHECK(rows >= 3 * 4);  // brute_force has them only if it traces every ray

  const auto straight = check("time-only");
  CHECK(straight["bent_every"].is_null());
  for (const auto& row : straight["rows"]) CHECK(row["source"] != "bent");
}

TEST_CASE("check compares only the intersectors that are named, on whole pings") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const Outcome outcome = run_program(
      folder.path(),
      {"check", "tiny.toml", "--rays", "3000", "--json", "--intersector", "embree,fan-scan"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  const auto report = nlohmann::json::parse(outcome.out);
  for (const auto& row : report["rows"])
    CHECK((row["intersector"] == "embree" || row["intersector"] == "fan_scan"));
  CHECK(report["pings"] > 0);
  CHECK(outcome.err.find(" whole pings; --rays 3000 asks for at least 1500") != std::string::npos);
}

TEST_CASE("check of ten rays finds no class too frequent, whatever they are aimed at") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  for (const char* seed : {"seed=1", "seed=2", "seed=3", "seed=4"}) {
    const Outcome outcome =
        run_program(folder.path(), {"check", "tiny.toml", "--quiet", "--rays", "10",
                                    "--intersector", "embree,fan_scan", "-D", seed});
    INFO(seed << ": " << outcome.err << outcome.out);
    CHECK(outcome.code == 0);
    CHECK(outcome.out.find(",aimed_rays,2,") != std::string::npos);
  }
}

TEST_CASE("check refuses wrong arguments") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const Outcome unknown =
      run_program(folder.path(), {"check", "tiny.toml", "--intersector", "embre"});
  CHECK(unknown.code == 2);
  CHECK(unknown.err.find("there is no intersector 'embre'; there are: ") != std::string::npos);
  for (const char* rays : {"0", "-5", "2.5", "1e13", "nan", "many"}) {
    const Outcome wrong = run_program(folder.path(), {"check", "tiny.toml", "--rays", rays});
    CHECK(wrong.code == 2);
    CHECK(wrong.out.empty());
    CHECK(wrong.err.find("--rays") != std::string::npos);
  }
  CHECK(run_program(folder.path(), {"check", "none.toml"}).code == 2);
}

TEST_CASE("check caches the analysed seafloor, and prints its table so far when stopped") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const fs::path cache = folder / "cache";
  const auto kept = [&] {
    return fs::exists(cache) &&
           std::ranges::any_of(fs::directory_iterator(cache),
                               [](const auto& file) { return file.path().extension() == ".mesh"; });
  };
  // When the analysis is in the cache, the comparison of rays follows soon.
  const Outcome stopped = run_program(
      folder.path(), {"check", "tiny.toml", "--rays", "100000000", "--json", "--cache", "cache"},
      {}, [&](pid_t process) {
        for (int i = 0; i < 1000 && !kept(); ++i)
          std::this_thread::sleep_for(std::chrono::milliseconds(10));
        kill(process, SIGINT);
      });
  CHECK(stopped.code == 128 + SIGINT);
  CHECK(stopped.err.find("stopped on request after ") != std::string::npos);
  CHECK(stopped.err.find("7 of 7") == std::string::npos);
  const auto report = nlohmann::json::parse(stopped.out);
  CHECK(report["stopped"] == true);
  CHECK(!report["rows"].empty());

  const auto small = [&](const char* more) {
    return run_program(folder.path(),
                       {"check", "tiny.toml", "--quiet", "--rays", "3000", "--cache", more});
  };
  const Outcome warm = small("cache");
  CHECK(warm.code == 0);
  CHECK(warm.out == small("another").out);
  CHECK(fs::exists(folder / "another"));
}

TEST_CASE("a run with --verify compares some of its pings with the reference") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const auto run = [&](const std::string& output, std::vector<std::string> more) {
    more.insert(more.begin(), {"run", "tiny.toml", "-o", output, "--quiet", "--json", "-D",
                               "output.npz=true", "--intersector", "fan_scan"});
    return run_program(folder.path(), more);
  };
  const auto manifest = [&](const std::string& output) {
    return nlohmann::json::parse(read_text(folder / output / "manifest.json"));
  };
  for (const std::string surface : {"static", "refined", "footprint"}) {
    CAPTURE(surface);
    const Outcome plain = run("plain-" + surface, {"--surface", surface});
    const Outcome verified =
        run("verified-" + surface, {"--surface", surface, "--verify", "3", "--threads", "2"});
    INFO(verified.err);
    CHECK(plain.code == 0);
    CHECK(verified.code == 0);
    auto found = manifest("verified-" + surface);
    const auto counts = found["verification"];
    CHECK(counts["pings"] == 3);
    CHECK(counts["rays"] > 3000);
    CHECK(counts["same"] == counts["rays"]);
    CHECK(counts["unexplained"] == 0);
    CHECK(nlohmann::json::parse(verified.out)["verification"] == counts);
    found.erase("verification");
    CHECK(found == manifest("plain-" + surface));  // including the hashes of all files
  }
  CHECK(!manifest("plain-static").contains("verification"));
  const Outcome all = run("all", {"--verify", "1000"});
  CHECK(manifest("all")["verification"]["pings"] == 9);
  for (const char* pings : {"0", "-1", "many"}) CHECK(run("none", {"--verify", pings}).code == 2);
}

TEST_CASE("a verified run fails if the analysis misses faces") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  REQUIRE(run_program(folder.path(), {"analyse", "tiny.toml", "-o", "bed.mesh"}).code == 0);
  const auto run = [&] {
    return run_program(
        folder.path(),
        {"run", "tiny.toml", "-o", "run", "--quiet", "-D", "seafloor.kind=progressive", "-D",
         "seafloor.progressive=bed.mesh", "--surface", "footprint", "--verify", "9"});
  };
  const Outcome sound = run();
  INFO(sound.err);
  CHECK(sound.code == 0);
  shrink_spheres(folder / "bed.mesh");
  const Outcome faulty = run();
  INFO(faulty.err);
  CHECK(faulty.code == 1);
  CHECK(faulty.err.find("differ from the exact reference") != std::string::npos);
  CHECK(fs::exists(folder / "run" / "manifest.json"));
}
