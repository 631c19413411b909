#include <ensonify/engine/run/part_record.h>

#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/run/json_record-inl.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/trace/check/agreement.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

void add(const std::map<std::string, std::uint64_t>& more,
         std::map<std::string, std::uint64_t>& to) {
  for (const auto& [name, count] : more) to[name] += count;
}

/// Calls f(name, value) for every entry of part.json, except the program's and its version.
template <class Record, class F>
void for_each_entry(Record& record, F&& f) {
  f("run_xxh128", record.run_xxh128);
  f("first_ping", record.pings.first);
  f("pings", record.pings.count);
  f("surface", record.surface);
  f("instruction_set", record.code_path);
  f("classes", record.names.classes);
  f("materials", record.names.materials);
  f("seafloor", record.seafloor);
  f("counts", record.counts);
  f("verification", record.verification);
  f("pings_over_hole", record.pings_over_hole);
  f("object_visibility", record.object_visibility);
  f("target_sights", record.target_sights);
  f("warnings", record.warnings);
  f("files", record.files);
}

template <class Value>
Json written(const Value& value) {
  return value;
}

template <class Value>
void read(const Json& json, Value& value) {
  whole_numbers(json).get_to(value);
}

using VisibilityBySonar = std::map<std::string, std::vector<ObjectVisibility>>;

/// For each sonar the numbers [object, alone, seen, object, alone, seen, ...] of the objects that a
/// ray could have met.
Json written(const VisibilityBySonar& by_sonar) {
  Json json = Json::object();
  for (const auto& [sonar, views] : by_sonar) {
    Json numbers = Json::array();
    for (std::size_t i = 0; i < views.size(); ++i)
      if (views[i].alone > 0)
        numbers.insert(numbers.end(), {Json(i), Json(views[i].alone), Json(views[i].seen)});
    json[sonar] = {{"objects", views.size()}, {"views", numbers}};
  }
  return json;
}

void read(const Json& json, VisibilityBySonar& by_sonar) {
  for (const auto& [sonar, its] : json.items()) {
    std::vector<ObjectVisibility>& views = by_sonar[sonar];
    views.resize(whole_numbers(its.at("objects"), max_labels).get<std::size_t>());
    const auto numbers = whole_numbers(its.at("views")).get<std::vector<std::uint64_t>>();
    for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
      views.at(numbers[i]) = {numbers[i + 1], numbers[i + 2]};
  }
}

using SightsBySonar = std::map<std::string, std::map<std::uint32_t, TargetSights>>;

/// For each sonar a list; its entries are [instance, true for the body or false for the shadow,
/// pixels to port, pixels to starboard, Sight::directions to the north and east]. If the sonar has
/// further sectors, an object follows with their pixels by name.
Json written(const SightsBySonar& by_sonar) {
  Json json = Json::object();
  for (const auto& [sonar, targets] : by_sonar) {
    Json& list = json[sonar] = Json::array();
    for (const auto& [instance, sights] : targets)
      for (const Sight* sight : {&sights.body, &sights.shadow}) {
        if (sight->pixels() == 0) continue;
        auto further = sight->sector_px;
        const std::size_t port = std::exchange(further[std::string(port_sector.name)], 0),
                          starboard = std::exchange(further[std::string(starboard_sector.name)], 0);
        std::erase_if(further, [](const auto& sector) { return sector.second == 0; });
        Json& entry = list.emplace_back(Json{instance, sight == &sights.body, port, starboard,
                                             sight->directions.x(), sight->directions.y()});
        if (!further.empty()) entry.push_back(further);
      }
  }
  return json;
}

void read(const Json& json, SightsBySonar& by_sonar) {
  for (const auto& [sonar, list] : json.items())
    for (const Json& its : list) {
      TargetSights& sights =
          by_sonar[sonar][whole_numbers(its.at(0), max_labels).get<std::uint32_t>()];
      Sight& sight = its.at(1).get<bool>() ? sights.body : sights.shadow;
      if (its.size() > 6) read(its.at(6), sight.sector_px);
      read(its.at(2), sight.sector_px[std::string(port_sector.name)]);
      read(its.at(3), sight.sector_px[std::string(starboard_sector.name)]);
      sight.directions = {its.at(4).get<double>(), its.at(5).get<double>()};
    }
}

Json written(const std::vector<FileRecord>& files) {
  Json json = Json::array();
  for (const FileRecord& file : files)
    json.push_back({{"name", file.name}, {"size_bytes", file.size_bytes}, {"xxh128", file.xxh128}});
  return json;
}

void read(const Json& json, std::vector<FileRecord>& files) {
  for (const Json& its : json) {
    FileRecord& file = files.emplace_back(FileRecord{
        .name = its.at("name").get<std::string>(), .xxh128 = its.at("xxh128").get<std::string>()});
    read(its.at("size_bytes"), file.size_bytes);
    if (!stays_inside(file.name))
      throw std::invalid_argument(fmt::format("'{}' is not in the run's folder", file.name));
  }
}

}  // namespace

PartRecord& PartRecord::operator+=(const PartRecord& next) {
  const auto require_same = [&](std::string_view what, const std::string& mine,
                                const std::string& its) {
    if (mine != its)
      throw SceneError(
          fmt::format("the parts that begin at pings {} and {} were made with another {}: {} and "
                      "{}; set run.instruction_set, remove one part and run it again",
                      pings.first, next.pings.first, what, mine, its));
  };
  require_same("surface", surface, next.surface);
  require_same("code path", code_path, next.code_path);
  if (seafloor != next.seafloor)
    throw SceneError(
        fmt::format("the parts that begin at pings {} and {} were made over different seafloors; "
                    "remove one and run it again",
                    pings.first, next.pings.first));
  pings.count += next.pings.count;
  add(next.counts, counts);
  add(next.verification, verification);
  pings_over_hole += next.pings_over_hole;
  for (const auto& [sonar, its] : next.object_visibility) {
    std::vector<ObjectVisibility>& views = object_visibility[sonar];
    views.resize(its.size());
    for (std::size_t i = 0; i < its.size(); ++i) views[i] += its[i];
  }
  for (const auto& [sonar, its] : next.target_sights)
    for (const auto& [instance, sights] : its) {
      TargetSights& sum = target_sights[sonar][instance];
      sum.body += sights.body;
      sum.shadow += sights.shadow;
    }
  files.insert(files.end(), next.files.begin(), next.files.end());
  return *this;
}

std::map<std::string, std::uint64_t> PartRecord::all_counts() const {
  std::map<std::string, std::uint64_t> all = counts;
  all.insert(seafloor.begin(), seafloor.end());
  return all;
}

std::string part_json(const PartRecord& record) {
  Json json = {{"program", "ensonify"}, {"version", program_version()}};
  for_each_entry(record, [&](const char* name, const auto& value) { json[name] = written(value); });
  return json_text(json, 1) + "\n";
}

PartRecord read_part_json(const std::filesystem::path& file) {
  return read_json_record(file, "record of a part", make_part_again, [](const Json& json) {
    PartRecord record;
    for_each_entry(record, [&](const char* name, auto& value) { read(json.at(name), value); });
    return record;
  });
}

std::vector<std::string> warnings_of(const PartRecord& run, const std::string& intersector) {
  std::vector<std::string> warnings;
  if (!run.verification.empty()) {
    AgreementCounts found;
    for_each_count(
        found, [&](const char* name, std::uint64_t& count) { count = run.verification.at(name); });
    for (const Limit& limit : limits(RaySource::scene, intersector_kind(intersector).precision))
      if (exceeds(limit, found))
        warnings.push_back(fmt::format(
            "of {} rays that were verified {} are of the class '{}', more than rounding "
            "explains (at most {:.0f})",
            found.rays, limit.of(found), limit.name, std::floor(most_allowed(limit, found.rays))));
  }
  if (run.pings_over_hole > 0)
    warnings.push_back(fmt::format(
        "{} of {} pings have no bed straight below (a hole in the seafloor); their altitude is "
        "empty",
        run.pings_over_hole, run.pings.count));
  return warnings;
}

std::string manifest_json(const RunPlan& plan, const PartRecord& run) {
  std::map<std::string, std::uint64_t> counts = run.all_counts();
  counts["warnings"] = run.warnings.size();
  Json json = {
      {"program", "ensonify"},
      {"version", program_version()},
      {"libraries", json_of<Json>(library_versions())},
      {"scene", plan.scene_toml},
      {"scene_hash", xxh128(plan.scene_toml)},
      {"seed", plan.seed},
      {"code_path",
       {{"surface", run.surface},
        {"intersector", plan.intersector},
        {"instruction_set", run.code_path}}},
      {"classes", run.names.classes},
      {"materials", run.names.materials},
      {"counts", counts},
      {"warnings", run.warnings},
      {"files", written(run.files)},
  };
  if (!plan.reference.empty()) json["reference"] = plan.reference;
  const RunParts& parts = plan.parts;
  for (std::size_t part = 0; parts.count() > 1 && part < parts.count(); ++part)
    json["parts"].push_back({{"folder", parts.folder(part)},
                             {"first_ping", parts.range(part).first},
                             {"pings", parts.range(part).count}});
  if (!run.verification.empty()) json["verification"] = run.verification;
  // json_text() replaces bytes that are not UTF-8 by U+FFFD; scene_hash is of the original bytes.
  return json_text(json, 2) + "\n";
}

}  // namespace ensonify::engine
