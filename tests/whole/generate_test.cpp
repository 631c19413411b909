#include <sys/mount.h>
#include <sys/resource.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <thread>

#include <ensonify/engine/dataset/generate.h>
#include <ensonify/engine/dataset/recipe.h>
#include <ensonify/engine/output/png.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/generate.h"
#include "support/grids.h"
#include "support/program.h"
#include "support/tiny_recipe.h"
#include "support/tree.h"

using namespace ensonify::tests;
namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

void check_whole(const fs::path& folder, const std::string& dataset,
                 const std::map<std::string, std::string>& expected) {
  const Outcome outcome = run_program(folder, {"merge", dataset, "--quiet"});
  INFO(outcome.err);
  CHECK(outcome.code == 0);
  CHECK(difference(tree_of(folder / dataset), expected) == "");
}

/// The files of a dataset that is made without interruption.
std::map<std::string, std::string> tree_of_whole_dataset(const fs::path& folder) {
  generate_whole(folder, "expected", {"--threads", "1"});
  REQUIRE(run_program(folder, {"merge", "expected", "--quiet"}).code == 0);
  return tree_of(folder / "expected");
}

void check_killed_datasets(int kills, std::size_t samples) {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml",
             changed(tiny_recipe, "samples = 8", "samples = " + std::to_string(samples)));
  const auto expected = tree_of_whole_dataset(folder.path());
  std::mt19937 random(7);
  int killed = 0;
  for (int round = 0; killed < kills; ++round) {
    REQUIRE(round < 20 * kills);
    const std::string dataset = "killed";
    const Outcome outcome =
        generate(folder.path(), dataset, {"--threads", "2"}, [&](pid_t process) {
          std::this_thread::sleep_for(std::chrono::milliseconds(5 + random() % 400));
          kill(process, SIGKILL);
        });
    if (outcome.code == -SIGKILL)
      ++killed;
    else
      REQUIRE(outcome.code == 0);
    if (outcome.code == 0) {  // finished: begin again
      check_whole(folder.path(), dataset, expected);
      fs::remove_all(folder / dataset);
    }
  }
  generate_whole(folder.path(), "killed");
  check_whole(folder.path(), "killed", expected);
}

}  // namespace

TEST_CASE("a dataset is the same on one or two threads, and in shards in either order") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  const auto expected = tree_of_whole_dataset(folder.path());
  CHECK(expected.contains("samples/000007/left-right.exr"));
  CHECK(expected.contains("samples/000000/left-right.r1.png"));
  CHECK(expected.contains("samples/000000/left-right.class.png"));
  CHECK(expected.contains("samples/000003/left-right_ground.png"));
  CHECK(expected.contains("samples/000003/tiles/left-right_0000.instance.png"));
  CHECK(expected.contains("samples/000003/chips/left-right_background_0000.png"));
  CHECK(expected.contains("coco/slant_tile_train.json"));
  CHECK(expected.contains("yolo/ground_line.yaml"));

  generate_whole(folder.path(), "threads", {"--threads", "2"});
  check_whole(folder.path(), "threads", expected);
  for (const int count : {3, 7}) {
    const std::string forward = "forward" + std::to_string(count),
                      backward = "backward" + std::to_string(count);
    for (int i = 0; i < count; ++i) {
      generate_whole(folder.path(), forward,
                     {"--shard", std::to_string(i) + "/" + std::to_string(count)});
      generate_whole(folder.path(), backward,
                     {"--shard", std::to_string(count - 1 - i) + "/" + std::to_string(count)});
    }
    check_whole(folder.path(), forward, expected);
    check_whole(folder.path(), backward, expected);
  }
}

TEST_CASE(
    "tars do not depend on threads and shards, have the folders' files, and a damaged one is "
    "found") {
  const TemporaryFolder folder;
  const std::string in_tars =
      changed(tiny_recipe, "seafloors = 4", "seafloors = 4\nsamples_per_tar = 3");
  write_text(folder / "recipe.toml", in_tars);
  const auto expected = tree_of_whole_dataset(folder.path());
  CHECK(expected.contains("tars/000002.tar"));
  CHECK(!fs::exists(folder / "expected/samples/000000"));
  for (const int i : {2, 0, 1})
    generate_whole(folder.path(), "shards",
                   {"--shard", std::to_string(i) + "/3", "--threads", "2"});
  check_whole(folder.path(), "shards", expected);

  write_text(folder / "recipe.toml", tiny_recipe);
  generate_whole(folder.path(), "folders");
  REQUIRE(run_program(folder.path(), {"merge", "folders", "--quiet"}).code == 0);
  // Only the hash of dataset.json differs, because that file says whether there are tars.
  const auto lines = [&](const char* dataset) {
    std::istringstream text(read_text(folder / (std::string(dataset) + "/manifest.jsonl")));
    std::vector<nlohmann::json> records;
    for (std::string line; std::getline(text, line);) {
      records.push_back(nlohmann::json::parse(line));
      records.back().erase("dataset_xxh128");
      records.back().erase("xxh128");
    }
    return records;
  };
  CHECK(lines("folders") == lines("expected"));

  std::string tar = read_text(folder / "shards/tars/000001.tar");
  tar[tar.size() / 2] ^= 1;
  write_text(folder / "shards/tars/000001.tar", tar);
  const Outcome outcome = run_program(folder.path(), {"merge", "shards", "--quiet"});
  CHECK(outcome.code == 1);
  CHECK(outcome.err.find("tars/000001.tar/00000") != std::string::npos);  // names the sample
  CHECK(outcome.err.find("remove the folders or tars") != std::string::npos);

  // One that was cut short is made again.
  write_text(folder / "recipe.toml", in_tars);
  tar[tar.size() / 2] ^= 1;
  write_text(folder / "shards/tars/000001.tar", tar.substr(0, tar.size() / 3));
  generate_whole(folder.path(), "shards");
  check_whole(folder.path(), "shards", expected);
}

TEST_CASE("a run of a sample's scene.toml gives the sample's bytes") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  generate_whole(folder.path(), "set");
  for (const char* sample : {"000000", "000005"}) {
    const fs::path there = folder / "set/samples" / sample;
    REQUIRE(run_program(folder.path(),
                        {"run", (there / "scene.toml").string(), "-o", sample, "--quiet"})
                .code == 0);
    const auto alone = tree_of(folder / sample);
    CHECK(alone.size() == 8);  // exr, npz, png, xtf, jsf, pings, targets, manifest
    for (const auto& [name, content] : alone) {
      CAPTURE(sample, name);
      CHECK(read_text(there / name) == content);
    }
  }
}

TEST_CASE("a sample's scene with a key without effect makes the sample's manifest, and warns") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml",
             changed(tiny_recipe, "[track]\n", "[track]\nlegs = 7\nleg_length_m = 33\n"));
  generate_whole(folder.path(), "set");
  const std::string expected = read_text(folder / "set/samples/000002/manifest.json");
  fs::create_directories(folder / "elsewhere");
  fs::copy_file(folder / "set/samples/000002/scene.toml", folder / "elsewhere/other.toml");
  for (const std::string scene :
       {"set/samples/000002/scene.toml", "./elsewhere/../elsewhere/other.toml"}) {
    CAPTURE(scene);
    const Outcome alone =
        run_program(folder.path(), {"run", scene, "-o", "alone", "--json", "--quiet"});
    REQUIRE(alone.code == 0);
    CHECK(read_text(folder / "alone/manifest.json") == expected);
    const Json warnings = Json::parse(alone.out).at("warnings");
    REQUIRE(warnings.size() == 2);
    for (const Json& warning : warnings) {
      CHECK(warning.get<std::string>().starts_with(scene + ":"));
      CHECK(alone.err.find("ensonify: warning: " + warning.get<std::string>()) !=
            std::string::npos);
    }
  }
  CHECK(Json::parse(expected).at("warnings").empty());
}

TEST_CASE("samples that share a bed are alone what they are together, also with other tracers") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", R"(
version = 1
[dataset]
samples = 2
seafloors = 1
[seafloor]
extent_east_m = 60
extent_north_m = 40
cell_m = 0.25
[track]
pings = 64
altitude_m = 5
[sonar.sidescan]
range_m = 25
bins = 200
[run]
intersector = { choice = ["fan_scan", "embree"], stratified = true }
)");
  const auto together = tree_of_whole_dataset(folder.path());
  for (const char* shard : {"1/2", "0/2"})
    generate_whole(folder.path(), "apart", {"--threads", "1", "--shard", shard});
  check_whole(folder.path(), "apart", together);
}

TEST_CASE("a sample has the files that its scene names by relative paths") {
  const TemporaryFolder folder;
  fs::create_directories(folder / "recipes/meshes");
  write_text(folder / "recipes/meshes/a.obj",
             "v 0 0 0\nv 4 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  const std::string recipe = changed(
      changed(tiny_recipe, "shape = { choice = [\"box\", \"cylinder\"] }",
              "mesh = \"meshes/a.obj\"\nlength_m = 2"),
      "class = { by = \"objects.0.shape\", table = { box = \"crate\", cylinder = \"mine\" } }",
      "class = \"crate\"");
  write_text(folder / "recipes/recipe.toml", recipe);
  REQUIRE(run_program(folder.path(), {"generate", "recipes/recipe.toml", "-o", "set", "--quiet",
                                      "-D", "dataset.samples=2", "-D", "dataset.seafloors=1"})
              .code == 0);
  const fs::path sample = folder / "set/samples/000001";
  CHECK(read_text(sample / "meshes/a.obj") == read_text(folder / "recipes/meshes/a.obj"));
  REQUIRE(run_program("/", {"run", (sample / "scene.toml").string(), "-o",
                            (folder / "again").string(), "--quiet"})
              .code == 0);
  for (const auto& [name, content] : tree_of(folder / "again")) {
    CAPTURE(name);
    CHECK(read_text(sample / name) == content);
  }
  const Json targets = Json::parse(read_text(sample / "left-right_targets.json"));
  REQUIRE(targets.at("targets").size() == 1);
  const Json& size = targets.at("targets").at(0).at("size_m");
  CHECK(size.at(2).get<double>() == Approx(0.5).epsilon(1e-5));  // 4 units became 2 m
  const Json dataset = Json::parse(read_text(folder / "set/dataset.json"));
  CHECK(dataset.at("overrides") == Json{"dataset.samples=2", "dataset.seafloors=1"});
  CHECK(dataset.at("assets").at(0).at("name") == "meshes/a.obj");
  // The same folder with other overrides is another dataset.
  CHECK(run_program(folder.path(), {"generate", "recipes/recipe.toml", "-o", "set", "--quiet", "-D",
                                    "dataset.samples=3"})
            .code == 2);
}

TEST_CASE("a sample has the files that its scene's files are read with") {
  const TemporaryFolder folder;
  fs::create_directories(folder / "maps/tiles");
  Tiff tiff;
  tiff.columns = 81;
  tiff.rows = 41;
  tiff.transform = {0, 0.5, 0, 20.5, 0, -0.5};
  for (std::uint32_t i = 0; i < tiff.columns * tiff.rows; ++i)
    tiff.heights.push_back(-15.0f - 0.01f * static_cast<float>(i % tiff.columns));
  write_text(folder / "maps/tiles/bed.tif", tiff.bytes());
  const auto write_mosaic = [&](const std::string& source) {
    write_text(folder / "maps/bed.vrt",
               "<VRTDataset rasterXSize=\"81\" rasterYSize=\"41\"><SRS>EPSG:32619</SRS>"
               "<GeoTransform>0, 0.5, 0, 20.5, 0, -0.5</GeoTransform><VRTRasterBand "
               "dataType=\"Float32\" band=\"1\"><SimpleSource><SourceFilename relativeToVRT=\"" +
                   source +
                   "</SourceFilename><SourceBand>1</SourceBand></SimpleSource>"
                   "</VRTRasterBand></VRTDataset>");
  };
  write_mosaic("1\">tiles/bed.tif");
  // Without its world file the image would be stretched over the bed.
  ensonify::engine::Picture picture{.width = 96, .height = 48, .pixels = {}};
  for (std::size_t i = 0; i < 96 * 48; ++i) picture.pixels.push_back(i % 96 < 50 ? 1 : 2);
  const std::vector<std::byte> png = ensonify::engine::encode_png(picture);
  write_text(folder / "maps/map.png", {reinterpret_cast<const char*>(png.data()), png.size()});
  write_text(folder / "maps/map.pgw", "0.5\n0\n0\n-0.5\n-3\n22\n");
  write_text(folder / "recipe.toml",
             changed(tiny_recipe,
                     "extent_east_m = 40\nextent_north_m = 20\ncell_m = 0.25\n"
                     "depth_m = { uniform = [12, 20] }\n",
                     "kind = \"survey\"\nsurvey = \"maps/bed.vrt\"\n") +
                 "[[seafloor.patches]]\nmaterial = \"silt\"\nimage = \"maps/map.png\"\n");
  const std::vector<std::string> two{"-D", "dataset.samples=2", "-D", "dataset.seafloors=1"};
  generate_whole(folder.path(), "set", two);
  const fs::path sample = folder / "set/samples/000001";
  fs::rename(folder / "maps", folder / "elsewhere");
  const Outcome again = run_program(
      "/", {"run", (sample / "scene.toml").string(), "-o", (folder / "again").string(), "--quiet"});
  fs::rename(folder / "elsewhere", folder / "maps");
  INFO(again.err);
  REQUIRE(again.code == 0);
  for (const auto& [name, content] : tree_of(folder / "again")) {
    CAPTURE(name);
    CHECK(read_text(sample / name) == content);
  }
  std::vector<std::string> assets;
  const Json dataset = Json::parse(read_text(folder / "set/dataset.json"));
  for (const Json& asset : dataset.at("assets")) assets.push_back(asset.at("name"));
  CHECK(assets == std::vector<std::string>{"maps/bed.vrt", "maps/map.pgw", "maps/map.png",
                                           "maps/tiles/bed.tif"});

  // Changed, they make another dataset.
  write_text(folder / "maps/map.pgw", "0.5\n0\n0\n-0.5\n-2\n22\n");
  const Outcome other = generate(folder.path(), "set", two);
  CHECK(other.code == 2);
  CHECK(other.err.find("the data file maps/map.pgw has changed") != std::string::npos);
  // No copy of such a mosaic finds its sources.
  write_mosaic("0\">" + (folder / "maps/tiles/bed.tif").string());
  const Outcome absolute = generate(folder.path(), "absolute", two);
  CHECK(absolute.code != 0);
  CHECK(absolute.err.find("'seafloor.survey' names maps/bed.vrt, whose copy in a sample") !=
        std::string::npos);
}

TEST_CASE("a dataset that is killed several times becomes the same tree, without leftovers") {
  check_killed_datasets(6, 8);
}

TEST_CASE("a dataset that is killed 60 times becomes the same tree, without leftovers", "[.soak]") {
  check_killed_datasets(60, 24);
}

TEST_CASE("a merge that is killed several times writes the same files, without leftovers") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  const std::vector<std::string> merge{"merge", "killed", "--quiet", "--webdataset"};
  generate_whole(folder.path(), "killed");
  REQUIRE(run_program(folder.path(), merge).code == 0);
  const auto expected = tree_of(folder / "killed");
  std::mt19937 random(11);
  int killed = 0;
  for (int round = 0; round < 60 && killed < 8; ++round) {
    const Outcome outcome = run_program(folder.path(), merge, {}, [&](pid_t process) {
      std::this_thread::sleep_for(std::chrono::milliseconds(random() % 150));
      kill(process, SIGKILL);
    });
    killed += outcome.code == -SIGKILL;
  }
  CHECK(killed > 0);
  REQUIRE(run_program(folder.path(), merge).code == 0);
  CHECK(difference(tree_of(folder / "killed"), expected) == "");
}

TEST_CASE("SIGTERM exits with 75, and the same command continues") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", changed(tiny_recipe, "elevations = 160", "elevations = 4000"));
  const auto expected = tree_of_whole_dataset(folder.path());
  const auto start = std::chrono::steady_clock::now();
  const Outcome outcome =
      generate(folder.path(), "set", {"--threads", "1", "--json"}, [&](pid_t process) {
        while (!fs::exists(folder / "set/samples/000001"))
          std::this_thread::sleep_for(std::chrono::milliseconds(2));
        kill(process, SIGTERM);
      });
  INFO(outcome.err);
  CHECK(outcome.code == 75);
  CHECK(outcome.err.find("continues from there") != std::string::npos);
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::minutes(2));
  for (const auto& entry : fs::directory_iterator(folder / "set/samples"))
    CHECK(!entry.path().filename().string().starts_with("."));
  CHECK(Json::parse(outcome.out).at("stopped") == true);
  generate_whole(folder.path(), "set");
  check_whole(folder.path(), "set", expected);
}

TEST_CASE(
    "a failed sample is reported, the others are made, and a rerun makes only what is missing") {
  const TemporaryFolder folder;
  // Places the object outside the seabed in about every second sample.
  write_text(folder / "recipe.toml",
             changed(tiny_recipe, "[track]\n", "[track]\nmiddle_east_m = { choice = [0, 500] }\n"));
  const Outcome outcome = generate(folder.path(), "set", {"--json"});
  CHECK(outcome.code == 3);
  const Json first = Json::parse(outcome.out);
  CHECK(first.at("failed").size() > 0);
  CHECK(first.at("made").get<int>() > 0);
  CHECK(first.at("made").get<std::size_t>() + first.at("failed").size() == 8);
  CHECK(outcome.err.find("failed: ") != std::string::npos);
  const Outcome again = generate(folder.path(), "set", {"--json"});
  CHECK(again.code == 3);
  CHECK(Json::parse(again.out).at("made") == 0);
  CHECK(Json::parse(again.out).at("found") == first.at("made"));
  const Outcome merged = run_program(folder.path(), {"merge", "set", "--quiet"});
  CHECK(merged.code == 1);
  CHECK(merged.err.find("are missing") != std::string::npos);
  CHECK(!fs::exists(folder / "set/manifest.jsonl"));
}

TEST_CASE("two processes on one folder make one dataset together") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  const auto expected = tree_of_whole_dataset(folder.path());
  for (int round = 0; round < 3; ++round) {
    const std::string dataset = "both" + std::to_string(round);
    Outcome other;
    std::thread second([&] { other = generate(folder.path(), dataset); });
    const Outcome outcome = generate(folder.path(), dataset);
    second.join();
    INFO(outcome.err << other.err);
    CHECK(outcome.code == 0);
    CHECK(other.code == 0);
    check_whole(folder.path(), dataset, expected);
  }
}

TEST_CASE("damaged samples are made again, and a folder that is no sample is refused") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  const auto expected = tree_of_whole_dataset(folder.path());
  generate_whole(folder.path(), "dataset");
  fs::resize_file(folder / "dataset/samples/000001/left-right.exr", 50);
  fs::remove(folder / "dataset/samples/000003/scene.toml");
  const Outcome dry = generate(folder.path(), "dataset", {"--dry-run"});
  CHECK(dry.out.find("\"finished\": 6") != std::string::npos);
  generate_whole(folder.path(), "dataset");
  check_whole(folder.path(), "dataset", expected);

  const auto check_refused = [&](const std::string& named) {
    const auto before = tree_of(folder / "dataset");
    const Outcome outcome = generate(folder.path(), "dataset");
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.err.find("dataset/samples/" + named) != std::string::npos);
    CHECK(difference(tree_of(folder / "dataset"), before) == "");
  };
  fs::remove(folder / "dataset/samples/000001/left-right.exr");
  write_text(folder / "dataset/samples/000001/thesis.txt", "precious");
  check_refused("000001/thesis.txt: not a file of the sample");
  fs::resize_file(folder / "dataset/samples/000001/sample.json", 50);
  check_refused("000001: a sample without a readable sample.json");
  fs::remove(folder / "dataset/samples/000001/sample.json");
  check_refused("000001: no sample of a dataset");
  fs::remove_all(folder / "dataset/samples/000001");
  fs::copy(folder / "dataset/samples/000002", folder / "dataset/samples/000001",
           fs::copy_options::recursive);
  check_refused("000001: a sample of another dataset or number");
}

TEST_CASE("looking at finished samples can be stopped") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  generate_whole(folder.path(), "dataset");
  int calls = 0;
  const ensonify::engine::GenerateReport report = ensonify::engine::generate(
      ensonify::engine::Recipe(folder / "recipe.toml", {}), folder / "dataset",
      {.threads = 1, .progress = [&](std::size_t, std::size_t) {
         ++calls;
         return false;
       }});
  CHECK(report.stopped);
  CHECK(report.found == 0);
  CHECK(calls == 1);
}

TEST_CASE("a folder with another dataset is refused and not changed") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  generate_whole(folder.path(), "set", {"--shard", "0/4"});
  const auto before = tree_of(folder / "set");
  write_text(folder / "recipe.toml", changed(tiny_recipe, "seed = 0", "seed = 1"));
  const Outcome outcome = generate(folder.path(), "set");
  CHECK(outcome.code == 2);
  CHECK(outcome.err.find("choose another folder with -o") != std::string::npos);
  CHECK(difference(tree_of(folder / "set"), before) == "");
  for (const char* shard : {"3", "4/4", "-1/4", "a/b", "0/0"}) {
    CAPTURE(shard);
    CHECK(generate(folder.path(), "other", {"--shard=" + std::string(shard)}).code == 2);
    CHECK(!fs::exists(folder / "other"));
  }
}

TEST_CASE("generate names a folder's file that is no description of a dataset, in its own words") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  fs::create_directory(folder / "dataset");
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  for (const std::string& content :
       {std::string("{"), std::string("[]"), std::string(R"({"recipe": 5})"), deep,
        Json{{"recipe", tiny_recipe}, {"overrides", 1}}.dump(),
        Json{{"recipe", tiny_recipe}, {"assets", 1}}.dump()}) {
    write_text(folder / "dataset/dataset.json", content);
    const Outcome outcome = generate(folder.path(), "dataset");
    CAPTURE(content.substr(0, 40), outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.err.starts_with(
        "ensonify: dataset/dataset.json: the folder holds another dataset: "));
    CHECK(outcome.err.find("json.exception") == std::string::npos);
    const Outcome merged = run_program(folder.path(), {"merge", "dataset"});
    CHECK(merged.code == 2);
    CHECK(merged.err.starts_with("ensonify: dataset/dataset.json: not a dataset's description"));
    CHECK(merged.err.find("json.exception") == std::string::npos);
  }
}

TEST_CASE("a file of the data folder whose name is not UTF-8 is named, and has to be renamed") {
  const TemporaryFolder folder;
  fs::create_directory(folder / "data");
  write_text(folder / "data/m\xe9sh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write_text(folder / "recipe.toml",
             tiny_recipe + "[[objects]]\nmesh = \"data:*.obj\"\nmaterial = \"plain\"\n");
  const Outcome outcome = generate(folder.path(), "dataset", {"--data", "data"});
  CAPTURE(outcome.err);
  CHECK(outcome.code == 2);
  CHECK(outcome.err.find("matches m\\xE9sh.obj, a name that is not UTF-8 as TOML is: rename it") !=
        std::string::npos);
}

TEST_CASE("a file-size limit is reported with the path, and finished samples stay complete") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  const auto expected = tree_of_whole_dataset(folder.path());
  generate_whole(folder.path(), "set", {"--shard", "0/4"});
  const auto before = tree_of(folder / "set");
  const Outcome outcome = generate(folder.path(), "set", {"--threads", "1"}, [](pid_t process) {
    const rlimit limit{20000, 20000};
    REQUIRE(prlimit(process, RLIMIT_FSIZE, &limit, nullptr) == 0);
  });
  CHECK(outcome.code == 1);
  CHECK(outcome.err.find("set/samples/") != std::string::npos);
  CHECK(outcome.err.find("ulimit -f") != std::string::npos);
  CHECK(difference(tree_of(folder / "set"), before) == "");
  generate_whole(folder.path(), "set");
  check_whole(folder.path(), "set", expected);
}

TEST_CASE(
    "a full disk and a read-only one are reported with the path, and finished samples stay "
    "complete") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  fs::create_directory(folder / "small");
  if (mount("tmpfs", (folder / "small").c_str(), "tmpfs", 0, "size=1m") != 0) {
    WARN("no right to mount a small file system: skipped");
    return;
  }
  struct Unmount {
    fs::path place;
    ~Unmount() { umount2(place.c_str(), MNT_DETACH); }
  } unmount{folder / "small"};
  const Outcome full = generate(folder.path(), "small/set", {"--threads", "1"});
  CHECK(full.code == 1);
  CHECK(full.err.find("small/set/samples/") != std::string::npos);
  CHECK(full.err.find("free some space") != std::string::npos);
  std::size_t finished = 0;
  for (const auto& entry : fs::directory_iterator(folder / "small/set/samples")) {
    CHECK(!entry.path().filename().string().starts_with("."));
    CHECK(fs::exists(entry.path() / "sample.json"));
    ++finished;
  }
  CHECK(finished > 0);

  REQUIRE(mount(nullptr, (folder / "small").c_str(), nullptr, MS_REMOUNT | MS_RDONLY, nullptr) ==
          0);
  const Outcome read_only = generate(folder.path(), "small/set");
  CHECK(read_only.code == 1);
  CHECK(read_only.err.find("small/set") != std::string::npos);
  CHECK(std::ranges::count(read_only.err, '\n') == 1);
}

TEST_CASE("a sample that is in a tar, but whose folder cannot be removed, is no hindrance") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", changed(tiny_recipe, "samples = 8\nseafloors = 4",
                                             "samples = 4\nseafloors = 4\nsamples_per_tar = 4"));
  const auto expected = tree_of_whole_dataset(folder.path());
  const fs::path first = folder / "set/samples/000000";
  const Outcome killed = generate(folder.path(), "set", {"--threads", "1"}, [&](pid_t process) {
    for (int i = 0; i < 60000 && !fs::exists(first); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(process, SIGKILL);
  });
  REQUIRE(killed.code == -SIGKILL);
  REQUIRE(fs::exists(first));
  // A folder with another file system in it cannot be removed, but moved.
  const fs::path busy = first / "busy";
  fs::create_directory(busy);
  if (mount("tmpfs", busy.c_str(), "tmpfs", 0, "size=1m") != 0) {
    WARN("no right to mount a small file system: skipped");
    return;
  }
  const fs::path hidden = folder / "set/tars/.000000.tar.0.tmp";
  generate_whole(folder.path(), "set");
  CHECK_FALSE(fs::exists(first));
  CHECK(fs::exists(hidden));
  generate_whole(folder.path(), "set");
  CHECK(fs::exists(hidden));
  REQUIRE(umount2((hidden / "000000/busy").c_str(), MNT_DETACH) == 0);
  generate_whole(folder.path(), "set");
  check_whole(folder.path(), "set", expected);
}

TEST_CASE("memory does not grow over two hundred samples", "[.soak]") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", changed(changed(tiny_recipe, "samples = 8", "samples = 200"),
                                             "seafloors = 4", "seafloors = 100"));
  std::vector<double> resident_mb;
  const Outcome outcome = generate(folder.path(), "set", {"--threads", "2"}, [&](pid_t process) {
    resident_mb = memory_mb(process, "VmRSS:");
  });
  REQUIRE(outcome.code == 0);
  REQUIRE(resident_mb.size() > 40);
  const std::array<double, 4> largest_mb = largest_of_quarters(resident_mb);
  CAPTURE(largest_mb[0], largest_mb[3]);
  CHECK(largest_mb[3] < largest_mb[1] + 8.0);
}

TEST_CASE("extrapolated levels give one warning per dataset, for any values drawn") {
  const TemporaryFolder folder;
  const std::string drawn = changed(
      changed(
          changed(tiny_recipe, "bins = 80", "bins = 80\nfrequency_hz = { uniform = [2e5, 6e5] }"),
          "material = \"plain\"\n[material", "material = \"clay\"\n[material"),
      "material = \"plain\"\neast_m", "material = \"rock\"\neast_m");
  write_text(folder / "recipe.toml", drawn);
  const auto warnings_of = [&](std::vector<std::string> arguments) {
    const Outcome outcome = run_program(folder.path(), std::move(arguments));
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    std::istringstream text(outcome.err);
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);)
      if (line.find("kHz") != std::string::npos) lines.push_back(line);
    return lines;
  };
  const std::vector<std::string> lines = warnings_of({"generate", "recipe.toml", "-o", "set"});
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].find("levels are extrapolated") != std::string::npos);
  CHECK(lines[0].ends_with(" kHz for rock"));
  CHECK(warnings_of({"generate", "recipe.toml", "-o", "quiet", "--quiet"}) == lines);
}

TEST_CASE("a preview is a picture, and --dry-run makes nothing") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  REQUIRE(run_program(folder.path(),
                      {"preview", "recipe.toml", "-o", "sheet.png", "-n", "3", "--quiet"})
              .code == 0);
  CHECK(read_text(folder / "sheet.png").starts_with("\x89PNG"));
  CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 2);
  const Outcome outcome = generate(folder.path(), "set", {"--dry-run"});
  CHECK(outcome.code == 0);
  CHECK(Json::parse(outcome.out).at("samples") == 8);
  CHECK(outcome.err.empty());
  CHECK(!fs::exists(folder / "set"));
}

TEST_CASE("a dry run finds vehicles that would be above the sea surface") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  const Outcome outcome = generate(folder.path(), "set", {"--dry-run", "-D", "seafloor.depth_m=3"});
  CHECK(outcome.code == 0);
  const Json above = Json::parse(outcome.out).at("above_water");
  CHECK((!above.empty() && above.size() < 8));  // altitudes are from 2 to 4 m
  CHECK(outcome.err.find("the vehicle would leave the water") != std::string::npos);
}

TEST_CASE("a held-out value that no sample has is refused, or named before any sample is made") {
  const TemporaryFolder folder;
  const auto held_out = [&](const std::string& by, const std::string& values) {
    write_text(folder / "recipe.toml", changed(tiny_recipe, "test = 1\n",
                                               "test = 1\nby = [\"seafloor\", \"" + by +
                                                   "\"]\nheld_out_test = " + values + "\n"));
  };
  held_out("objects.0.shape", "[\"box\", \"cylindre\"]");
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--dry-run"}, std::vector<std::string>{}}) {
    const Outcome refused = generate(folder.path(), "set", more);
    CHECK(refused.code == 2);
    CHECK(
        refused.err.find("names \"cylindre\", which no value of objects.0.shape matches; expected "
                         "some of box, cylinder") != std::string::npos);
  }
  CHECK(!fs::exists(folder / "set"));
  held_out("seafloor.depth_m", "[\"14\"]");
  const std::string warning =
      "ensonify: warning: dataset.split.held_out_test names \"14\", which no sample has";
  const Outcome rehearsed = generate(folder.path(), "set", {"--dry-run"});
  CHECK(rehearsed.code == 0);
  CHECK(rehearsed.err.starts_with(warning));
  CHECK(rehearsed.err.find("the split test is empty: no sample is in it by "
                           "dataset.split.held_out_test") != std::string::npos);
  CHECK(rehearsed.err.find("is drawn") == std::string::npos);
  const Outcome made = generate(folder.path(), "set", {"--json"});
  CHECK(made.code == 0);
  CHECK(made.err.starts_with(warning));
  CHECK(("ensonify: warning: " + Json::parse(made.out).at("warnings").at(0).get<std::string>())
            .starts_with(warning));
}

TEST_CASE("what a killed preview leaves is removed by the next one for that picture") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", tiny_recipe);
  const fs::path scratch = folder / ".sheet.png.0.tmp";
  const Outcome killed =
      run_program(folder.path(), {"preview", "recipe.toml", "-o", "sheet.png"}, {}, [&](pid_t id) {
        for (int i = 0; i < 10000 && !fs::exists(scratch); ++i)
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        kill(id, SIGKILL);
      });
  REQUIRE(killed.code == -SIGKILL);
  REQUIRE(fs::exists(scratch));
  REQUIRE(run_program(folder.path(),
                      {"preview", "recipe.toml", "-o", "sheet.png", "-n", "1", "--quiet"})
              .code == 0);
  CHECK(read_text(folder / "sheet.png").starts_with("\x89PNG"));
  CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 2);
}

TEST_CASE("a preview that is stopped keeps the samples that are finished, or says that none is") {
  const TemporaryFolder folder;
  write_text(folder / "recipe.toml", changed(tiny_recipe, "samples = 8", "samples = 1000"));
  const auto stopped = [&](const std::string& sheet, int after_ms) {
    return run_program(folder.path(), {"preview", "recipe.toml", "-o", sheet, "-n", "1000"}, {},
                       [&](pid_t process) {
                         std::this_thread::sleep_for(std::chrono::milliseconds(after_ms));
                         kill(process, SIGINT);
                       });
  };
  // On a slow machine the wait may be too short for a sample: then the message says so.
  const Outcome outcome = stopped("sheet.png", 5000);
  INFO(outcome.err);
  CHECK(outcome.code == 128 + SIGINT);
  if (fs::exists(folder / "sheet.png")) {
    CHECK(outcome.err.find(" of 1000 samples, which are in sheet.png") != std::string::npos);
    CHECK(read_text(folder / "sheet.png").starts_with("\x89PNG"));
  } else {
    CHECK(outcome.err.find("nothing was written") != std::string::npos);
  }
  CHECK(!fs::exists(folder / ".sheet.png.0.tmp"));
}
