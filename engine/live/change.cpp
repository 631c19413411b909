#include <ensonify/engine/live/change.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/untrusted.h>
#include <ensonify/engine/simulator/prepare.h>

namespace ensonify::engine {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array known_keys{"set", "hold", "pings_per_s", "add", "clear", "again"};
constexpr std::string_view altitude_key = "track.altitude_m", speed_key = "track.speed_mps";

double number_in(const Json& value, std::string_view what, double low, double high) {
  if (!value.is_number() || !(value.get<double>() >= low && value.get<double>() <= high))
    throw std::invalid_argument(fmt::format("'{}' is {}, expected a number from {} to {}", what,
                                            json_text(value), low, high));
  return value.get<double>();
}

bool truth_in(const Json& value, std::string_view what) {
  if (!value.is_boolean())
    throw std::invalid_argument(
        fmt::format("'{}' is {}, expected true or false", what, json_text(value)));
  return value.get<bool>();
}

SceneChange asked_scene(const Json& set, const SessionScene& now) {
  if (!set.is_object() || set.empty())
    throw std::invalid_argument(
        R"('set' names no key, expected as in {"set": {"track.altitude_m": 6}})");
  std::vector<KeyValue> all, of_scene;
  for (const auto& [key, value] : set.items()) {
    all.push_back({key, toml_text(key, value)});
    // Altitude and speed change the vehicle, not the scene's track.
    if (key != altitude_key && key != speed_key) of_scene.push_back(all.back());
  }
  const Scene checked = now.with(all);
  SceneChange to = scene_change(std::move(of_scene), now);
  if (set.contains(altitude_key)) to.vehicle.altitude_m = checked.track.altitude_m;
  if (set.contains(speed_key)) to.vehicle.speed_mps = checked.track.speed_mps;
  return to;
}

AddedObject added_object(const Json& object, const SessionScene& now, std::uint32_t objects) {
  if (!object.is_object())
    throw std::invalid_argument(
        R"('add' is not an object, expected as in {"shape": "barrel", "ahead_m": 10})");
  double ahead_m = 10.0, starboard_m = 10.0;
  std::vector<KeyValue> keys;
  for (const auto& [key, value] : object.items()) {
    if (key == "ahead_m")
      ahead_m = number_in(value, key, -10000, 10000);
    else if (key == "starboard_m")
      starboard_m = number_in(value, key, -10000, 10000);
    else
      keys.push_back({key, toml_text(key, value)});
  }
  return {object_of(keys, "'add'", now.with(), now.paths(), objects + 1), ahead_m, starboard_m};
}

}  // namespace

SceneChange scene_change(std::vector<KeyValue> keys, const SessionScene& before) {
  const auto is_display_key = [](const KeyValue& of) { return of.key.starts_with("display."); };
  SceneChange to{.keys = std::move(keys), .before = before};
  to.scene = with_session_surface(before.with(to.keys));
  to.seabed = !std::ranges::all_of(
      to.keys, [&](const KeyValue& of) { return is_sonar_key(of.key) || is_display_key(of); });
  if (!to.seabed) to.sonars = changed_sonars(to.scene, to.keys);
  if (std::ranges::any_of(to.keys, is_display_key)) to.display = to.scene.display;
  return to;
}

LiveChange read_change(std::string_view json, const SessionScene& now, std::uint32_t objects) {
  const Json request = json_of<Json>(json, R"(, expected as in {"hold": true})");
  if (!request.is_object() || request.empty())
    throw std::invalid_argument(R"(expected an object, as in {"set": {"track.altitude_m": 6}})");
  for (const auto& [key, value] : request.items())
    if (std::ranges::find(known_keys, key) == known_keys.end())
      throw std::invalid_argument(
          fmt::format("unknown key '{}', expected {}", key, fmt::join(known_keys, ", ")));
  LiveChange change;
  if (request.contains("hold")) change.hold = truth_in(request["hold"], "hold");
  if (request.contains("again")) change.again = truth_in(request["again"], "again");
  if (request.contains("clear")) change.clear = truth_in(request["clear"], "clear");
  if (const auto rate = request.find("pings_per_s"); rate != request.end()) {
    change.pings_per_s.emplace();
    if (!rate->is_null()) *change.pings_per_s = number_in(*rate, "pings_per_s", 0.0, 10000.0);
  }
  if (request.contains("add")) change.add = added_object(request["add"], now, objects);
  if (request.contains("set")) change.set = asked_scene(request["set"], now);
  return change;
}

}  // namespace ensonify::engine
