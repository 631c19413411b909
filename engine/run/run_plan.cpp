#include <ensonify/engine/run/run_plan.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <stdexcept>
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

constexpr double max_bytes_of_one_part = 1024.0 * 1024 * 1024;
constexpr double bytes_of_a_part = 64.0 * 1024 * 1024;
constexpr std::size_t step_pings = 64;  // the default size of a block: parts have whole blocks

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

RunParts::RunParts(std::vector<std::size_t> first_pings, std::size_t pings)
    : first_pings_(std::move(first_pings)), pings_(pings) {
  const auto no_more = std::ranges::adjacent_find(first_pings_, std::ranges::greater_equal());
  if (first_pings_.empty() || first_pings_.front() != 0 || no_more != first_pings_.end() ||
      first_pings_.back() >= pings)
    throw std::invalid_argument("RunParts: a run or a part without pings");
}

std::size_t RunParts::longest() const {
  std::size_t longest = 0;
  for (std::size_t part = 0; part < count(); ++part) longest = std::max(longest, range(part).count);
  return longest;
}

PingRange RunParts::range(std::size_t part) const {
  const std::size_t first = first_pings_[part];
  return {first, (part + 1 < count() ? first_pings_[part + 1] : pings_) - first};
}

std::size_t RunParts::part_of(std::size_t ping) const {
  return static_cast<std::size_t>(std::ranges::upper_bound(first_pings_, ping) -
                                  first_pings_.begin()) -
         1;
}

std::string RunParts::number(std::size_t part) const {
  // All numbers of a run have the same width, so that names sort as parts do.
  const std::size_t digits = std::max<std::size_t>(4, fmt::formatted_size("{}", count()));
  return fmt::format("{:0{}}", part + 1, digits);
}

std::string RunParts::folder(std::size_t part) const { return "part_" + number(part); }

std::filesystem::path RunParts::file(std::size_t part, const std::string& sonar,
                                     std::string_view ending) const {
  return std::filesystem::path(folder(part)) / fmt::format("{}_{}{}", sonar, number(part), ending);
}

std::size_t pings_per_part(const OutputOptions& output, std::span<const Sonar> sonars,
                           std::size_t pings) {
  if (output.pings_per_file > 0)
    return std::min(pings, static_cast<std::size_t>(output.pings_per_file));
  if (image_bytes(sonars, pings) <= max_bytes_of_one_part) return pings;
  const double steps = bytes_of_a_part / image_bytes(sonars, step_pings);
  return step_pings * std::max<std::size_t>(1, static_cast<std::size_t>(steps));
}

RunParts equal_parts(std::size_t pings, std::size_t pings_per_part) {
  const std::size_t whole_run = 0;
  return parts_of_legs({&whole_run, 1}, pings, pings_per_part);
}

RunParts parts_of_legs(std::span<const std::size_t> leg_starts, std::size_t pings,
                       std::size_t pings_per_part) {
  if (pings_per_part == 0) throw std::invalid_argument("RunParts: a part without pings");
  std::vector<std::size_t> first_pings;
  for (std::size_t leg = 0; leg < leg_starts.size(); ++leg) {
    const std::size_t end = leg + 1 < leg_starts.size() ? leg_starts[leg + 1] : pings;
    for (std::size_t first = leg_starts[leg]; first < end; first += pings_per_part)
      first_pings.push_back(first);
  }
  return {std::move(first_pings), pings};
}

std::size_t pings_in_memory(const Scene& scene, const RunParts& parts, int threads) {
  const auto written = static_cast<std::size_t>(threads);
  const std::size_t of_parts = std::min(parts.pings(), parts.longest() * (written + 1));
  if (parts.count() == 1) return of_parts;
  return of_parts +
         std::min(parts.count(), written) * 2 * neighbour_pings(scene.display, scene.sonars);
}

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
