// The content of a run's manifest.json.

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/settings.h"

#include <ensonify/engine/run/part_record.h>
#include <ensonify/engine/run/run_plan.h>

using namespace ensonify::engine;
using ensonify::tests::OtherSettings;

namespace {

RunPlan sample_plan() {
  return {.scene_toml = "version = 1\n# \"h\xc3\xa9\"\n",
          .seed = 0xffffffffffffffffu,
          .intersector = "embree",
          .reference = {},
          .parts = equal_parts(600, 600),
          .version = {},
          .libraries = {},
          .files = {}};
}

PartRecord sample_run() {
  PartRecord run;
  run.surface = "static";
  run.code_path = "avx2";
  run.names = {{"none", "seabed"}, {"none", "medium sand"}};
  run.seafloor = {{"faces", 8}};
  run.counts = {{"pings", 600}, {"rays", 5'000'000'000}};
  run.warnings = {"the bed has holes"};
  run.files = {{"a.exr", 12, xxh128("a")}, {"b.png", 0, xxh128("")}};
  return run;
}

}  // namespace

TEST_CASE("A manifest has its fields in order, with versions and the scene's hash") {
  const RunPlan plan = sample_plan();
  const auto json = nlohmann::ordered_json::parse(manifest_json(plan, sample_run()));
  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  CHECK(keys == std::vector<std::string>{"program", "version", "libraries", "scene", "scene_hash",
                                         "seed", "code_path", "classes", "materials", "counts",
                                         "warnings", "files"});
  CHECK(json["program"] == "ensonify");
  for (const char* library :
       {"embree", "fftw", "gdal", "libarchive", "libpng", "openexr", "proj", "zlib"}) {
    INFO(library);
    CHECK_FALSE(json["libraries"].at(library).get<std::string>().empty());
  }
  CHECK(json["libraries"]["proj"] != "0.0.0");
#if __has_include(<GeographicLib/Config.h>)
  CHECK_FALSE(json["libraries"].at("geographiclib").get<std::string>().empty());
#endif
  CHECK(json["scene"] == plan.scene_toml);
  CHECK(json["scene_hash"] == xxh128(plan.scene_toml));
  CHECK(json["seed"] == plan.seed);
  CHECK(json["code_path"]["surface"] == "static");
  CHECK(json["code_path"]["intersector"] == "embree");
  CHECK(json["code_path"]["instruction_set"] == "avx2");
  CHECK(json["classes"] == std::vector<std::string>{"none", "seabed"});
  CHECK(json["materials"] == std::vector<std::string>{"none", "medium sand"});
  CHECK(json["counts"]["rays"] == 5'000'000'000);
  CHECK(json["counts"]["faces"] == 8);
  CHECK(json["counts"]["warnings"] == 1);
  CHECK(json["warnings"] == std::vector<std::string>{"the bed has holes"});
  REQUIRE(json["files"].size() == 2);
  CHECK(json["files"][0]["name"] == "a.exr");
  CHECK(json["files"][0]["size_bytes"] == 12);
  CHECK(json["files"][1]["xxh128"] == "99aa06d3014798d86001c324468d497f");
}

TEST_CASE("An empty manifest has an empty list of files, not null") {
  const auto json = nlohmann::json::parse(manifest_json(sample_plan(), {}));
  CHECK(json["files"] == nlohmann::json::array());
  CHECK(json["warnings"] == nlohmann::json::array());
  CHECK(json["counts"] == nlohmann::json{{"warnings", 0}});
}

TEST_CASE("A manifest is valid UTF-8 for any bytes in the scene") {
  RunPlan plan = sample_plan();
  plan.scene_toml = std::string("\xff\xc3(\0\x1b\xed\xa0\x80 end", 12);
  PartRecord run = sample_run();
  run.warnings = {"\x80"};
  const std::string text = manifest_json(plan, run);
  CHECK(nlohmann::json::accept(text));  // this checks UTF-8
  CHECK(nlohmann::json::parse(text)["scene_hash"] == xxh128(plan.scene_toml));
}

TEST_CASE("A manifest has the same bytes in another locale") {
  const std::string text = manifest_json(sample_plan(), sample_run());
  const OtherSettings other;
  CHECK(manifest_json(sample_plan(), sample_run()) == text);
}

TEST_CASE("A manifest of a run in several parts lists their pings") {
  RunPlan plan = sample_plan();
  plan.parts = equal_parts(600, 400);
  const auto json = nlohmann::json::parse(manifest_json(plan, sample_run()));
  REQUIRE(json["parts"].size() == 2);
  CHECK(json["parts"][1] ==
        nlohmann::json{{"folder", "part_0002"}, {"first_ping", 400}, {"pings", 200}});
}
