#include <ensonify/engine/run/part_record.h>

#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/json_text.h>
#include <ensonify/engine/seafloor/seafloor.h>
#include <ensonify/engine/untrusted.h>
#include <ensonify/refine/read_file.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

void add(const std::map<std::string, std::uint64_t>& more,
         std::map<std::string, std::uint64_t>& to) {
  for (const auto& [name, count] : more) to[name] += count;
}

/// [object, alone, seen, object, ...] of the objects that a ray could have met.
Json visibility_json(const std::vector<ObjectVisibility>& views) {
  Json numbers = Json::array();
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (views[i].alone == 0) continue;
    numbers.push_back(i);
    numbers.push_back(views[i].alone);
    numbers.push_back(views[i].seen);
  }
  return {{"objects", views.size()}, {"views", numbers}};
}

std::vector<ObjectVisibility> visibility_of(const Json& json) {
  const auto objects = whole_numbers(json.at("objects")).get<std::size_t>();
  if (objects > max_labels) throw std::out_of_range("objects");
  std::vector<ObjectVisibility> views(objects);
  const Json& numbers = json.at("views");
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
    views.at(whole_numbers(numbers[i]).get<std::size_t>()) = {
        whole_numbers(numbers[i + 1]).get<std::uint64_t>(),
        whole_numbers(numbers[i + 2]).get<std::uint64_t>()};
  return views;
}

/// [instance, whether of the body, pixels to port, to starboard, directions north, east], and so
/// on; if the sonar has further sectors, their pixels by name follow.
Json sights_json(const std::map<std::uint32_t, TargetSights>& targets) {
  Json list = Json::array();
  for (const auto& [instance, sights] : targets)
    for (const Sight* sight : {&sights.body, &sights.shadow})
      if (sight->pixels() > 0) {
        auto further = sight->sector_px;
        const std::size_t port = std::exchange(further[std::string(port_sector.name)], 0),
                          starboard = std::exchange(further[std::string(starboard_sector.name)], 0);
        std::erase_if(further, [](const auto& sector) { return sector.second == 0; });
        Json& entry = list.emplace_back(Json{instance, sight == &sights.body, port, starboard,
                                             sight->directions.x(), sight->directions.y()});
        if (!further.empty()) entry.push_back(further);
      }
  return list;
}

std::map<std::uint32_t, TargetSights> sights_of(const Json& json) {
  std::map<std::uint32_t, TargetSights> targets;
  for (const Json& its : json) {
    TargetSights& sights = targets[whole_numbers(its.at(0), max_labels).get<std::uint32_t>()];
    Sight& sight = its.at(1).get<bool>() ? sights.body : sights.shadow;
    if (its.size() > 6)
      for (const auto& [sector, pixels] : its.at(6).items())
        sight.sector_px[sector] = whole_numbers(pixels).get<std::size_t>();
    sight.sector_px[std::string(port_sector.name)] = whole_numbers(its.at(2)).get<std::size_t>();
    sight.sector_px[std::string(starboard_sector.name)] =
        whole_numbers(its.at(3)).get<std::size_t>();
    sight.directions = {its.at(4).get<double>(), its.at(5).get<double>()};
  }
  return targets;
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

std::string part_json(const PartRecord& record) {
  Json files = Json::array();
  for (const FileRecord& file : record.files)
    files.push_back(
        {{"name", file.name}, {"size_bytes", file.size_bytes}, {"xxh128", file.xxh128}});
  Json visibility = Json::object();
  for (const auto& [sonar, views] : record.object_visibility)
    visibility[sonar] = visibility_json(views);
  Json sights = Json::object();
  for (const auto& [sonar, targets] : record.target_sights) sights[sonar] = sights_json(targets);
  const Json json = {
      {"program", "ensonify"},
      {"version", program_version()},
      {"run_xxh128", record.run_xxh128},
      {"first_ping", record.pings.first},
      {"pings", record.pings.count},
      {"surface", record.surface},
      {"instruction_set", record.code_path},
      {"classes", record.names.classes},
      {"materials", record.names.materials},
      {"seafloor", record.seafloor},
      {"counts", record.counts},
      {"verification", record.verification},
      {"pings_over_hole", record.pings_over_hole},
      {"object_visibility", visibility},
      {"target_sights", sights},
      {"warnings", record.warnings},
      {"files", files},
  };
  return json_text(json, 1) + "\n";
}

PartRecord read_part_json(const std::filesystem::path& file) {
  const auto no_record = [&](const std::exception& error) {
    return SceneError(
        fmt::format("{}: not the record of a part ({}); remove the part's folder and run it again",
                    file.string(), fault_in_json(error)));
  };
  try {
    const Json json = json_of<Json>(refine::read_file(file, most_json_bytes));
    PartRecord record;
    record.pings = {whole_numbers(json.at("first_ping")).get<std::size_t>(),
                    whole_numbers(json.at("pings")).get<std::size_t>()};
    json.at("run_xxh128").get_to(record.run_xxh128);
    json.at("surface").get_to(record.surface);
    json.at("instruction_set").get_to(record.code_path);
    json.at("classes").get_to(record.names.classes);
    json.at("materials").get_to(record.names.materials);
    json.at("seafloor").get_to(record.seafloor);
    whole_numbers(json.at("counts")).get_to(record.counts);
    whole_numbers(json.at("verification")).get_to(record.verification);
    whole_numbers(json.at("pings_over_hole")).get_to(record.pings_over_hole);
    const auto inside = [&](const std::string& name) {
      if (stays_inside(name)) return name;
      throw SceneError(
          fmt::format("{}: '{}' is not in the run's folder; remove the part's folder and run it "
                      "again",
                      file.string(), name));
    };
    for (const auto& [sonar, views] : json.at("object_visibility").items())
      record.object_visibility[inside(sonar)] = visibility_of(views);
    for (const auto& [sonar, targets] : json.at("target_sights").items())
      record.target_sights[inside(sonar)] = sights_of(targets);
    json.at("warnings").get_to(record.warnings);
    for (const Json& its : json.at("files"))
      record.files.push_back({inside(its.at("name").get<std::string>()),
                              whole_numbers(its.at("size_bytes")).get<std::uint64_t>(),
                              its.at("xxh128").get<std::string>()});
    return record;
  } catch (const Json::exception& error) {
    throw no_record(error);
  } catch (const std::invalid_argument& error) {
    throw no_record(error);
  } catch (const std::out_of_range&) {
    throw SceneError(
        fmt::format("{}: an object that is not there; remove the part's folder and run it again",
                    file.string()));
  }
}

}  // namespace ensonify::engine
