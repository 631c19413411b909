#pragma once

#include <filesystem>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include <ensonify/engine/output/manifest.h>

#include "support/files.h"

namespace ensonify::tests {

/// The texts of a dataset of one sample with one picture. It is written without the program, so
/// that a test can change any of them.
struct SmallDataset {
  std::string dataset =
      R"({"samples": 1, "samples_per_tar": 0, "target_classes": 1, "shadow_class": 0,)"
      R"( "title": "a", "recipe": "", "version": "1", "seafloors": 1, "classes": ["crate"],)"
      R"( "sediments": ["sand"], "licences": [], "assets": [{"name": "a"}], "licence": "",)"
      R"( "creator": "", "url": "", "published": "", "overrides": [], "splits": ["train"]})";
  std::string sample = R"({"sample": 0, "split": "train", "seafloor_seed": 1, "drawn": {"a": 1}})";
  std::string labels =
      R"({"image": "line", "pictures": ["line.png"], "kind": "line", "sonar": "a",)"
      R"( "geometry": "slant", "width": 9, "height": 2, "pixel_across_m": 1,)"
      R"( "pixel_along_m": 1, "seen_from": {}, "classes": ["crate"], "targets": [{)"
      R"("instance": 1, "class": "crate", "category_id": 1, "ignored": false, "shadow": null,)"
      R"( "body": {"box": [1, 1, 2, 1], "area_px": 2, "polygons": [[1, 1, 3, 1, 3, 2, 1, 2]]}}]})";

  /// Writes them to a new folder. Hashes are made to fit where a text is a JSON object.
  void write(const std::filesystem::path& folder) const {
    const std::filesystem::path place = folder / "samples/000000";
    std::filesystem::create_directories(place);
    const std::map<std::string, std::string> files{{"line.json", labels},
                                                   {"line.png", std::string(100, 'x')}};
    for (const auto& [name, content] : files) write_text(place / name, content);
    auto json = nlohmann::ordered_json::parse(dataset, nullptr, /* exceptions: */ false);
    const std::string hash = add_hash(json);
    write_text(folder / "dataset.json", json.is_object() ? json.dump() : dataset);
    write_text(place / "sample.json", with_hashes(files, hash));
  }

 private:
  /// Adds the hash of all other keys, and returns it.
  static std::string add_hash(nlohmann::ordered_json& json) {
    if (!json.is_object()) return "";
    json.erase("xxh128");
    std::string hash = engine::xxh128(json.dump());
    json["xxh128"] = hash;
    return hash;
  }

  std::string with_hashes(const std::map<std::string, std::string>& files,
                          const std::string& dataset_hash) const {
    auto json = nlohmann::ordered_json::parse(sample, nullptr, /* exceptions: */ false);
    if (!json.is_object()) return sample;
    json["files"] = nlohmann::ordered_json::array();
    for (const auto& [name, content] : files)
      json["files"].push_back(
          {{"name", name}, {"size_bytes", content.size()}, {"xxh128", engine::xxh128(content)}});
    json["dataset_xxh128"] = dataset_hash;
    add_hash(json);
    return json.dump();
  }
};

}  // namespace ensonify::tests
