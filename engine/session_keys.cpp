#include <ensonify/engine/session_keys.h>

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include <ensonify/engine/scene/checks/name_check.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/scene_paths.h>
#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/seafloor/objects/shapes.h>

namespace ensonify::engine {

SessionScene::SessionScene(std::string text, std::string name, std::vector<std::string> overrides,
                           ScenePaths paths)
    : text_(std::make_shared<const std::string>(std::move(text))),
      name_(std::move(name)),
      overrides_(std::move(overrides)),
      paths_(std::move(paths)) {}

SessionScene SessionScene::of_file(const std::filesystem::path& file,
                                   std::vector<std::string> overrides,
                                   const std::filesystem::path& data_folder) {
  return SessionScene(read_scene_text(file), file.string(), std::move(overrides),
                      scene_paths(file, data_folder));
}

Scene SessionScene::with(std::span<const KeyValue> changes) const {
  std::vector<std::string> all = overrides_;
  for (const auto& some : {std::span<const KeyValue>(changes_), changes})
    for (const KeyValue& change : some)
      all.push_back(fmt::format("{}={}", change.key, change.value));
  try {
    return parse_scene(*text_, name_, all, paths_);
  } catch (const SceneError& error) {
    // Remove "-D " from the message: the key did not come from the command line.
    if (changes.empty()) throw;
    std::string message = fmt::format(" {}", error.what());
    for (std::size_t at = 0; (at = message.find(" -D ", at)) != message.npos;) message.erase(at, 3);
    throw SceneError(message.substr(1));
  }
}

void SessionScene::keep(std::span<const KeyValue> changes) {
  for (const KeyValue& change : changes) {
    std::erase_if(changes_, [&](const KeyValue& kept) { return kept.key == change.key; });
    changes_.push_back(change);
  }
}

void SessionScene::take_back(std::span<const KeyValue> changes, const SessionScene& before) {
  for (const KeyValue& change : changes) {
    const auto kept = std::ranges::find(changes_, change);
    if (kept == changes_.end()) continue;
    changes_.erase(kept);
    const auto former = std::ranges::find(before.changes_, change.key, &KeyValue::key);
    if (former != before.changes_.end()) changes_.push_back(*former);
  }
}

bool is_sonar_key(std::string_view key) {
  static constexpr std::string_view sonar = "sonar.";
  if (!key.starts_with(sonar)) return false;
  key.remove_prefix(sonar.size());
  const auto bare = [](std::string_view word) {
    return !word.empty() && std::ranges::all_of(word, is_name_character);
  };
  const std::size_t dot = key.find('.');
  return dot != key.npos && bare(key.substr(0, dot)) && bare(key.substr(dot + 1));
}

std::vector<std::pair<std::size_t, Sonar>> changed_sonars(const Scene& scene,
                                                          std::span<const KeyValue> changes) {
  // A preset may change the scene's conditions, and with them all recorders (use_conditions()).
  const bool by_preset = std::ranges::any_of(
      changes, [](const KeyValue& change) { return change.key.ends_with(".preset"); });
  std::vector<std::pair<std::size_t, Sonar>> changed;
  for (std::size_t i = 0; i < scene.sonars.size(); ++i) {
    const std::string prefix = "sonar." + scene.sonars[i].name + ".";
    if (by_preset ||
        std::ranges::any_of(changes, [&](const KeyValue& c) { return c.key.starts_with(prefix); }))
      changed.emplace_back(i, scene.sonars[i]);
  }
  return changed;
}

void set_sonars(Simulator& simulator, SessionScene& scene, std::span<const KeyValue> changes) {
  for (const KeyValue& change : changes)
    if (!is_sonar_key(change.key))
      throw SceneError(
          fmt::format("'{}' cannot be set while the scene runs, expected a sonar's key, as "
                      "sonar.NAME.range_m, without quotes and spaces",
                      change.key));
  simulator.set_sonars(changed_sonars(scene.with(changes), changes));
  scene.keep(changes);
}

std::vector<std::string> warnings_for_single_pings(const Scene& scene) {
  std::vector<std::string> warnings;
  for (const auto& [key, share] : {std::pair{"artefacts.lost", scene.artefacts.lost},
                                   std::pair{"artefacts.repeated", scene.artefacts.repeated}})
    if (share > 0.0)
      warnings.push_back(fmt::format(
          "{}: has no effect on single pings, only in a run and in the live view", key));
  return warnings;
}

MovingObject object_of(std::span<const KeyValue> keys, std::string_view name, const Scene& scene,
                       const ScenePaths& paths, std::uint32_t number) {
  // Keys that an added object cannot have. Its pose gives place and attitude. Only objects of the
  // scene can be many, scour the bed, or have parts with separate labels.
  static constexpr std::array of_place{"east_m",       "north_m",       "height_m",
                                       "burial",       "follow_slope",  "heading_deg",
                                       "pitch_deg",    "roll_deg",      "path",
                                       "path_file",    "speed_mps",     "poses",
                                       "sag_radius_m", "burial_spread", "burial_scale_m",
                                       "count",        "area",          "area_radius_m",
                                       "margin_m",     "gap_m",         "heading_spread_deg",
                                       "assembly"};
  static constexpr std::array of_scene{"scour_ratio", "tail_ratio", "current_deg", "part_classes"};
  std::string text = "version = 1\n[[objects]]\n";
  for (const auto& [key, value] : keys) {
    if (std::ranges::find(of_place, std::string_view(key)) != of_place.end())
      throw SceneError(fmt::format(
          "{}: '{}' places an object on the seabed; an added object lies where its pose says", name,
          key));
    if (std::ranges::find(of_scene, std::string_view(key)) != of_scene.end())
      throw SceneError(fmt::format(
          "{}: '{}' is for objects of the scene; an added one has one label and leaves the bed as "
          "it is",
          name, key));
    for (const ShapeKind& kind : shape_kinds())
      if (kind.along_path && key == "shape" && value == toml_string(kind.name))
        throw SceneError(fmt::format(
            "{}: a {} is laid along a path on the seabed, and cannot be added", name, kind.name));
    if (value.find('\n') != value.npos)
      throw SceneError(fmt::format("{}: the value of '{}' has more than one line", name, key));
    text += fmt::format("{} = {}\n", toml_string(key), value);
  }
  const Scene with_object = parse_scene(text, name, {}, paths, scene.materials);
  const ObjectOptions& table = with_object.objects.front();
  return {.mesh = mesh_of(table, scene.seed, scene.materials, number),
          .material = table.material,
          .class_name = table.class_name};
}

}  // namespace ensonify::engine
