#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/program.h"
#include "support/tiny_scene.h"

#include <ensonify/engine/trace/intersector.h>

using namespace ensonify::tests;
namespace fs = std::filesystem;

TEST_CASE("check compares every intersector with the reference, and finds nothing unexplained") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const auto check = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"check", "tiny.toml", "--quiet", "--rays", "3e4"});
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

  const Outcome json = check({"--json"});
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
  CHECK(scene_rays >= 15000);  // more than the track has pings for: it is flown again
}

TEST_CASE("check refuses what it cannot do") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  for (const char* rays : {"0", "-5", "2.5", "1e13", "nan", "many"}) {
    const Outcome wrong = run_program(folder.path(), {"check", "tiny.toml", "--rays", rays});
    CHECK(wrong.code == 2);
    CHECK(wrong.out.empty());
    CHECK(wrong.err.find("--rays") != std::string::npos);
  }
  CHECK(run_program(folder.path(), {"check", "none.toml"}).code == 2);
}

TEST_CASE("check keeps the analysed seafloor, and when stopped tells what it has compared") {
  const TemporaryFolder folder;
  write_text(folder / "tiny.toml", tiny_scene);
  const fs::path cache = folder / "cache";
  const auto kept = [&] {
    return fs::exists(cache) &&
           std::ranges::any_of(fs::directory_iterator(cache),
                               [](const auto& file) { return file.path().extension() == ".mesh"; });
  };
  // Once the analysis is kept, whatever else it makes ready is followed by rays.
  const Outcome stopped = run_program(
      folder.path(), {"check", "tiny.toml", "--rays", "100000000", "--json", "--cache", "cache"},
      {}, [&](pid_t process) {
        for (int i = 0; i < 1000 && !kept(); ++i)
          std::this_thread::sleep_for(std::chrono::milliseconds(10));
        kill(process, SIGINT);
      });
  CHECK(stopped.code == 128 + SIGINT);
  CHECK(stopped.err.find("stopped on request after ") != std::string::npos);
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
