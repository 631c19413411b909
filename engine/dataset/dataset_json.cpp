#include <ensonify/engine/dataset/dataset_json.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/output/masks.h>
#include <ensonify/engine/output/tar.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::string text_of(const Json& json) { return json_text(json, 1) + "\n"; }

/// The first line of the written text that differs from the wanted one, for a message.
std::string first_difference(const std::string& written, const std::string& wanted) {
  std::istringstream old_lines(written), new_lines(wanted);
  std::string old_line, new_line;
  for (int number = 1;; ++number) {
    const bool had = bool(std::getline(old_lines, old_line));
    const bool has = bool(std::getline(new_lines, new_line));
    if (!had || !has || old_line != new_line)
      return fmt::format("line {} of its recipe is {}", number,
                         had ? "'" + old_line + "'" : "missing");
  }
}

/// The difference between the dataset of a folder and the wanted dataset, for a message.
std::string what_differs(const Json& written, const Json& wanted) {
  const std::string old_recipe = written.value("recipe", ""), recipe = wanted.value("recipe", "");
  if (old_recipe != recipe) return first_difference(old_recipe, recipe);
  const auto overrides = written.value("overrides", std::vector<std::string>());
  if (overrides != wanted.value("overrides", std::vector<std::string>()))
    return overrides.empty() ? "it was made without -D"
                             : fmt::format("it was made with -D {}", fmt::join(overrides, " -D "));
  const Json assets = written.value("assets", Json::array());
  for (const Json& asset : wanted.value("assets", Json::array()))
    if (std::ranges::find(assets, asset) == assets.end())
      return fmt::format("the data file {} has changed since", asset.value("name", ""));
  return "it was made by another version of the program";
}

/// Adds the key "xxh128": the hash of all other keys.
Json with_hash(Json json) {
  json["xxh128"] = xxh128(json_text(json));
  return json;
}

}  // namespace

std::string dataset_json(const Recipe& recipe) {
  const DatasetOptions& options = recipe.options();
  Json assets = Json::array();
  for (const std::string& asset : recipe.assets())
    assets.push_back({{"name", asset}, {"xxh128", xxh128_of_file(recipe.path_of(asset))}});
  return text_of(with_hash({{"program", "ensonify"},
                            {"version", program_version()},
                            {"libraries", json_of<Json>(library_versions())},
                            {"title", options.title},
                            {"samples", options.samples},
                            {"seafloors", recipe.seafloors()},
                            {"splits", splits_of(options.split)},
                            {"samples_per_tar", options.samples_per_tar},
                            {"classes", recipe.class_names()},
                            {"target_classes", recipe.target_classes()},
                            {"shadow_class", options.shadow_class ? recipe.target_classes() : 0},
                            {"sediments", recipe.material_names()},
                            {"first_number", 1},
                            {"ignore", ignored_class},
                            {"ignore_instance", ignored_instance},
                            {"assets", assets},
                            {"licences", options.licences},
                            {"licence", options.licence},
                            {"creator", options.creator},
                            {"url", options.url},
                            {"published", options.published},
                            {"recipe", recipe.text()},
                            {"overrides", recipe.overrides()},
                            {"recipe_hash", xxh128(recipe.text())}}));
}

std::string hash_in(const std::string& dataset_json) {
  return json_of<Json>(dataset_json).at("xxh128").get<std::string>();
}

void require_same_dataset(const fs::path& file, const std::string& content) {
  const std::string written = refine::read_file(file, most_json_bytes);
  if (written == content) return;
  std::string why = "the file is damaged";
  try {
    if (const Json old = json_or_null<Json>(written); old.is_object())
      why = what_differs(old, json_of<Json>(content));
  } catch (const Json::exception&) {  // a value of another type
  }
  throw SceneError(
      fmt::format("{}: the folder holds another dataset: {}; choose another folder with -o",
                  file.string(), why));
}

std::vector<std::string> splits_of(const SplitOptions& split) {
  std::vector<std::string> splits;
  if (split.train > 0.0) splits.emplace_back("train");
  if (split.val > 0.0 || !split.held_out_val.empty()) splits.emplace_back("val");
  if (split.test > 0.0 || !split.held_out_test.empty()) splits.emplace_back("test");
  return splits;
}

std::string sample_json(std::size_t number, const SampleScene& sample,
                        const std::string& dataset_json, const fs::path& folder) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) names.push_back(entry.path().lexically_relative(folder).string());
  std::ranges::sort(names);
  Json files = Json::array();
  for (const std::string& name : names) {
    const FileRecord record = record_of(folder, name);
    files.push_back({{"name", name}, {"size_bytes", record.size_bytes}, {"xxh128", record.xxh128}});
  }
  Json drawn = Json::object();
  for (const auto& [key, value] : sample.drawn)
    if (Json& its = drawn[key] = json_or_null<Json>(value); its.is_null() && !value.empty())
      its = value;
  return text_of(with_hash({{"sample", number},
                            {"dataset_xxh128", hash_in(dataset_json)},
                            {"split", sample.split},
                            {"seafloor", sample.seafloor},
                            {"seafloor_seed", sample.scene.bed_seed()},
                            {"seed", sample.scene.seed},
                            {"drawn", drawn},
                            {"files", files}}));
}

bool is_whole_sample(const fs::path& folder, std::size_t number,
                     const std::string& dataset_xxh128) {
  const auto refuse = [](const fs::path& place, std::string_view what) {
    throw SceneError(fmt::format(
        "{}: {}, in a place that generate needs; move it away, or choose another folder "
        "with -o",
        place.string(), what));
  };
  std::set<std::string> names{"sample.json"};
  bool whole = true;
  try {
    const Json json = json_of<Json>(refine::read_file(folder / "sample.json", most_json_bytes));
    if (json.at("dataset_xxh128") != dataset_xxh128 || json.at("sample") != number)
      refuse(folder, "a sample of another dataset or number");
    for (const Json& file : json.at("files")) {
      const std::string& name = *names.insert(file.at("name").get_ref<const std::string&>()).first;
      whole &= fs::exists(folder / name) && fs::file_size(folder / name) == file.at("size_bytes");
    }
  } catch (const Json::exception&) {
    refuse(folder, "a sample without a readable sample.json");
  } catch (const std::invalid_argument&) {
    refuse(folder, "a sample without a readable sample.json");
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::no_such_file_or_directory &&
        error.code() != std::errc::not_a_directory)
      throw;
    refuse(folder, "no sample of a dataset");
  }
  if (!whole)
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
      if (!entry.is_directory() &&
          !names.contains(entry.path().lexically_relative(folder).string()))
        refuse(entry.path(), "not a file of the sample");
  return whole;
}

SampleFolders::SampleFolders(fs::path dataset, std::size_t samples_per_tar)
    : dataset_(std::move(dataset)), samples_per_tar_(samples_per_tar) {}

bool SampleFolders::finished(std::size_t number) const {
  // A tar appears before its samples' folders are removed, so this order misses none.
  return fs::exists(sample(number)) ||
         (samples_per_tar_ > 0 && is_whole_tar(tar(number / samples_per_tar_)));
}

fs::path SampleFolders::sample(std::size_t number) const {
  return dataset_ / "samples" / name_of(number);
}
fs::path SampleFolders::tar(std::size_t number) const {
  return dataset_ / "tars" / (name_of(number) + ".tar");
}
std::string SampleFolders::name_of(std::size_t sample) { return fmt::format("{:06}", sample); }

std::string SampleFolders::name_in_tar(std::size_t sample, const std::string& file) {
  const std::size_t slash = file.find('/');
  if (slash == std::string::npos) return fmt::format("{:06}.{}", sample, file);
  return fmt::format("{:06}-{}-{}", sample, file.substr(0, slash), file.substr(slash + 1));
}

}  // namespace ensonify::engine
