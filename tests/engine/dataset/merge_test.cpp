// Datasets from others: their files contradict each other, but the hashes fit.

#include <ensonify/engine/dataset/merge.h>

#include <filesystem>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/scene/scene.h>

#include "support/catch.h"
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

TEST_CASE("a small dataset that another program wrote is merged") {
  const engine::MergeReport report = merged({});
  CHECK(report.damaged.empty());
  CHECK(report.samples == 1);
  CHECK(!report.files.empty());
}

TEST_CASE("a dataset.json with classes without names, endless or broken samples is refused") {
  for (const auto& [from, to] : {std::pair{R"("target_classes": 1)", R"("target_classes": 99)"},
                                 {R"("shadow_class": 0)", R"("shadow_class": 2)"},
                                 {R"("samples": 1)", R"("samples": 1000000000000000)"},
                                 {R"("samples": 1)", R"("samples": 7e102)"},
                                 {R"("samples": 1)", R"("samples": -1)"},
                                 {R"("samples": 1)", R"("splits": 1, "samples": 1)"}}) {
    CAPTURE(to);
    SmallDataset changed;
    changed.dataset = tests::changed(changed.dataset, from, to);
    CHECK_THROWS_AS(merged(changed), engine::SceneError);
  }
}

TEST_CASE("a dataset.json that does not fit its own hash is refused") {
  SmallDataset dataset;
  nlohmann::ordered_json json = nlohmann::ordered_json::parse(dataset.dataset);
  json["xxh128"] = engine::xxh128(json.dump());
  dataset.dataset = json.dump();
  CHECK(merged(dataset).samples == 1);
  dataset.dataset = tests::changed(dataset.dataset, "sand", "silt");
  CHECK_THROWS_WITH(merged(dataset), Catch::Contains("has changed since it was written"));
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
