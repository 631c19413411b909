#include <ensonify/engine/run/run_plan.h>

#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/run/json_record-inl.h>
#include <ensonify/engine/scene/dump.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/seafloor/bed/survey.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

/// The values of a plan's scene, by key. Throws SceneError if the plan's text is not a scene.
std::map<std::string, std::string> values_of(const RunPlan& plan) {
  std::map<std::string, std::string> values;
  // Unchecked, because files that the scene names may be missing by now.
  const Scene scene = parse_recipe_unchecked(plan.scene_toml, "the scene of run.json", {});
  for_each_key(scene, [&](const std::string& name, const auto& key, const auto& owner) {
    if (std::optional<std::string> value = option_text(key, owner))
      values[name] = std::move(*value);
  });
  return values;
}

/// One hash for a file and the files behind it.
std::string hash_of_files(const std::filesystem::path& file) {
  std::string hash = xxh128_of_file(file);
  for (const std::filesystem::path& behind : files_behind(file))
    hash =
        xxh128(fmt::format("{} {} {}", hash, behind.filename().string(), xxh128_of_file(behind)));
  return hash;
}

}  // namespace

RunPlan make_plan(const Scene& scene, const std::string& reference, std::size_t verify_pings,
                  const RunParts& parts) {
  RunPlan plan{.scene_toml = dump_scene(scene, false),
               .seed = scene.seed,
               .intersector = scene.run.intersector,
               .reference = reference,
               .verify_pings = verify_pings,
               .parts = parts,
               .version = std::string(program_version()),
               .libraries = library_versions()};
  if (parts.count() == 1) return plan;
  for_each_file(scene, [&](const std::string& key, const InputFile& file) {
    if (!file.path.empty()) plan.files[key] = hash_of_files(file.path);
  });
  return plan;
}

std::filesystem::path plan_file(const std::filesystem::path& folder) { return folder / "run.json"; }

std::string plan_json(const RunPlan& plan) {
  const Json json = {{"program", "ensonify"},
                     {"version", plan.version},
                     {"libraries", json_of<Json>(plan.libraries)},
                     {"scene", plan.scene_toml},
                     {"seed", plan.seed},
                     {"intersector", plan.intersector},
                     {"reference", plan.reference},
                     {"verify_pings", plan.verify_pings},
                     {"input_files", plan.files},
                     {"pings", plan.parts.pings()},
                     {"first_pings", plan.parts.first_pings()}};
  return json_text(json, 2) + "\n";
}

std::string hash_of(const RunPlan& plan) { return xxh128(plan_json(plan)); }

RunPlan read_plan(const std::filesystem::path& folder) {
  const auto read = [](const Json& json) -> RunPlan {
    return {.scene_toml = json.at("scene").get<std::string>(),
            .seed = whole_numbers(json.at("seed")).get<std::uint64_t>(),
            .intersector = json.at("intersector").get<std::string>(),
            .reference = json.at("reference").get<std::string>(),
            .verify_pings = whole_numbers(json.at("verify_pings")).get<std::size_t>(),
            .parts = RunParts(whole_numbers(json.at("first_pings")).get<std::vector<std::size_t>>(),
                              whole_numbers(json.at("pings")).get<std::size_t>()),
            .version = json.at("version").get<std::string>(),
            .libraries = json.at("libraries").dump(),
            .files = json.at("input_files").get<std::map<std::string, std::string>>()};
  };
  return read_json_record(plan_file(folder), "plan of a run",
                          "remove it and the folder's parts, and run again", read);
}

std::vector<std::string> differences(const RunPlan& before, const RunPlan& now) {
  std::vector<std::string> found;
  const auto compare = [&](std::string_view what, const std::string& was, const std::string& is) {
    if (was != is) found.push_back(fmt::format("{} was {} and is {}", what, was, is));
  };
  compare("the version of ensonify", before.version, now.version);
  if (!found.empty()) return found;  // another version may have other keys
  const Json old_libraries = json_of<Json>(before.libraries),
             libraries = json_of<Json>(now.libraries);
  for (const auto& [name, version] : libraries.items())
    compare("the version of " + name, old_libraries.value(name, "none"),
            version.get<std::string>());
  compare("--verify", std::to_string(before.verify_pings), std::to_string(now.verify_pings));
  std::map<std::string, std::string> were = values_of(before);
  for (const auto& [key, value] : values_of(now)) {
    const auto was = were.extract(key);
    compare(key, was.empty() ? "not set" : was.mapped(), value);
  }
  for (const auto& [key, value] : were) compare(key, value, "not set");
  for (const auto& [key, hash] : now.files)
    if (const auto was = before.files.find(key); was != before.files.end() && was->second != hash)
      found.push_back(fmt::format(
          "the file of {} has another content (or one of its sources, or a file beside it)", key));
  compare("the number of pings", std::to_string(before.parts.pings()),
          std::to_string(now.parts.pings()));
  return found;
}

}  // namespace ensonify::engine
