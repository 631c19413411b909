// Datasets from others: their files contradict each other, but the hashes fit.

#include <ensonify/engine/dataset/merge.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include <ensonify/engine/output/staging.h>
#include <ensonify/engine/run.h>
#include <ensonify/engine/scene/scene.h>

#include "support/catch.h"
#include "support/files.h"
#include "support/program.h"
#include "support/small_dataset.h"
#include "support/tiny_recipe.h"

using namespace ensonify;
using tests::SmallDataset;

namespace {

engine::MergeReport merged(const SmallDataset& dataset) {
  const tests::TemporaryFolder folder;
  dataset.write(folder / "outer/set");
  engine::MergeReport report = engine::merge(folder / "outer/set");
  CHECK(std::distance(std::filesystem::directory_iterator(folder / "outer"), {}) == 1);
  return report;
}

}  // namespace

TEST_CASE("a small dataset is merged") {
  const engine::MergeReport report = merged({});
  CHECK(report.damaged.empty());
  CHECK(report.samples == 1);
  CHECK(!report.files.empty());
}

TEST_CASE("a merge stops at every step, and the next one makes the files of an undisturbed one") {
  const tests::TemporaryFolder folder;
  const std::filesystem::path set = folder / "set";
  SmallDataset().write(set);
  const auto files = [&] {
    std::map<std::string, std::string> texts;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(set))
      texts[entry.path().lexically_relative(set)] =
          entry.is_regular_file() ? tests::read_text(entry.path()) : "";
    return texts;
  };
  std::set<std::string> stages;
  std::size_t steps = 0, last = 1000;
  const auto merged_until_last = [&] {
    steps = 0;
    return engine::merge(set,
                         [&](std::string_view stage, std::size_t done, std::size_t of) {
                           CHECK(done < of);
                           stages.insert(std::string(stage));
                           return steps++ < last;
                         },
                         {.webdataset = true});
  };
  merged_until_last();
  const std::map<std::string, std::string> undisturbed = files();
  merged_until_last();
  const std::size_t all = steps;
  for (const char* stage : {"samples", "annotations", "pictures for YOLO", "pictures for the Hub",
                            "samples for WebDataset", "old files of hub"})
    CHECK(stages.contains(stage));
  for (std::size_t step = 0; step < all; ++step) {
    CAPTURE(step);
    last = step;
    CHECK_THROWS_AS(merged_until_last(), engine::Stopped);
    CHECK(steps == step + 1);
    last = 1000;
    merged_until_last();
    CHECK(files() == undisturbed);
  }
}

TEST_CASE("a merge removes what a killed one left, also of tars that it does not make") {
  const tests::TemporaryFolder folder;
  SmallDataset().write(folder / "set");
  const std::filesystem::path left = folder / "set/.webdataset.0.tmp";
  std::filesystem::create_directories(left / "inner");
  engine::merge(folder / "set");
  CHECK_FALSE(std::filesystem::exists(left));
}

TEST_CASE("a merge that waits for another one stops on request") {
  const tests::TemporaryFolder folder;
  SmallDataset().write(folder / "set");
  const auto other = engine::StagingFolder::try_claim(folder / "set/merge");
  REQUIRE(other);
  CHECK_THROWS_AS(engine::merge(folder / "set",
                                [](std::string_view stage, std::size_t, std::size_t) {
                                  return stage != "another merge of this folder";
                                }),
                  engine::Stopped);
}

TEST_CASE("a dataset.json with classes without names, endless or broken samples is refused") {
  for (const auto& [from, to] : {std::pair{R"("target_classes": 1)", R"("target_classes": 99)"},
                                 {R"("shadow_class": 0)", R"("shadow_class": 2)"},
                                 {R"("samples": 1)", R"("samples": 1000000000000000)"},
                                 {R"("samples": 1)", R"("samples": 7e102)"},
                                 {R"("samples": 1)", R"("samples": -1)"},
                                 {R"("splits": ["train"])", R"("splits": 1)"}}) {
    CAPTURE(to);
    SmallDataset changed;
    changed.dataset = tests::changed(changed.dataset, from, to);
    CHECK_THROWS_AS(merged(changed), engine::SceneError);
  }
}

TEST_CASE("a dataset.json that does not fit its own hash is refused") {
  const tests::TemporaryFolder folder;
  SmallDataset().write(folder / "set");
  const std::string text = tests::read_text(folder / "set/dataset.json");
  tests::write_text(folder / "set/dataset.json", tests::changed(text, "sand", "silt"));
  CHECK_THROWS_WITH(engine::merge(folder / "set"),
                    Catch::Contains("has changed since it was written"));
}

TEST_CASE("samples of another dataset, or under another number, are damage") {
  const tests::TemporaryFolder folder;
  SmallDataset().write(folder / "set");
  SmallDataset other;
  other.dataset = tests::changed(other.dataset, "crate", "mine");
  other.write(folder / "other");
  const auto copied = [&](const char* from) {
    std::filesystem::remove_all(folder / "set/samples/000000");
    std::filesystem::copy(folder / from / "samples/000000", folder / "set/samples/000000");
    return engine::merge(folder / "set").damaged;
  };
  REQUIRE(copied("other").size() == 1);
  CHECK_THAT(copied("other").front(), Catch::Contains("it is a sample of another dataset"));
  SmallDataset second;
  second.sample = tests::changed(second.sample, R"("sample": 0)", R"("sample": 1)");
  second.write(folder / "second");
  REQUIRE(copied("second").size() == 1);
  CHECK_THAT(copied("second").front(), Catch::Contains("it is another sample"));
}

TEST_CASE("labels that lead out of the dataset, or do not fit their picture, are damage") {
  for (const auto& [from, to] :
       {std::pair{R"("geometry": "slant")", R"("geometry": "../../../slant")"},
        {R"("kind": "line")", R"("kind": "../../../line")"},
        {R"(["line.png"])", R"(["../../../../line.png"])"},
        {R"(["line.png"])", R"([])"},
        {R"("height": 2)", R"("height": 0)"},
        {R"("height": 2)", R"("height": 1000000000)"},
        {R"("category_id": 1)", R"("category_id": 2)"},
        {R"("category_id": 1)", R"("category_id": 1e30)"},
        {R"([[1, 1, 3,)", R"([[1, 1, 4294967296,)"},
        {R"([[1, 1, 3,)", R"([[1, -1e10, 3,)"},
        {R"([[1, 1, 3, 1, 3, 2, 1, 2]])", R"([[], [1, 1, 3, 1, 3, 2, 1, 2]])"},
        {R"("polygons")", R"("rle": {"counts": [0, 1000000000000]}, "polygons")"}}) {
    CAPTURE(to);
    SmallDataset changed;
    changed.labels = tests::changed(changed.labels, from, to);
    const engine::MergeReport report = merged(changed);
    CHECK(report.damaged.size() == 1);
    CHECK(report.files.empty());
  }
}
