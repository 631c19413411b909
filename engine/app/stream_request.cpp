#include "stream_request.h"

#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ensonify/engine/base/json_text.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/base/untrusted.h>

namespace ensonify::engine::app {
namespace {

using Json = nlohmann::ordered_json;

/// The fields of a request. Each field is taken once; a field that is left over is an error.
class Fields {
 public:
  explicit Fields(Json fields) : fields_(std::move(fields)) {
    if (!fields_.is_object())
      throw std::invalid_argument(fmt::format("expected an object, for example {}", example));
  }

  std::optional<Json> take(const std::string& key) {
    const auto found = fields_.find(key);
    if (found == fields_.end()) return std::nullopt;
    Json value = std::move(*found);
    fields_.erase(found);
    return value;
  }

  double number(const std::string& key, std::optional<double> otherwise = std::nullopt) {
    const std::optional<Json> value = take(key);
    if (!value && otherwise) return *otherwise;
    if (!value)
      throw std::invalid_argument(fmt::format("there is no '{}', expected as in {}", key, example));
    if (!value->is_number())
      throw std::invalid_argument(fmt::format("'{}' is {}, expected a number", key, value->dump()));
    return value->get<double>();
  }

  Pose pose() {
    const auto degrees = [&](const std::string& key) { return number(key, 0.0) * degree; };
    Pose pose;
    pose.t_s = number("t_s", 0.0);
    pose.position = {number("x_m"), number("y_m"), number("z_m")};
    pose.roll_rad = degrees("roll_deg");
    pose.pitch_rad = degrees("pitch_deg");
    pose.heading_rad = degrees("heading_deg");
    pose.velocity_mps = {number("vx_mps", 0.0), number("vy_mps", 0.0), number("vz_mps", 0.0)};
    pose.roll_rate_radps = degrees("roll_rate_degps");
    pose.pitch_rate_radps = degrees("pitch_rate_degps");
    pose.heading_rate_radps = degrees("heading_rate_degps");
    return pose;
  }

  const Json& rest() const { return fields_; }
  void finish() const {
    if (!fields_.empty())
      throw std::invalid_argument(
          fmt::format("unknown key '{}', expected keys as in {}", fields_.begin().key(), example));
  }

 private:
  static constexpr std::string_view example =
      R"({"t_s": 0.5, "x_m": 0, "y_m": 2, "z_m": -10, "roll_deg": 0, "pitch_deg": 0, )"
      R"("heading_deg": 0})";
  Json fields_;
};

std::uint32_t instance_of(const Json& value) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > 0xffff)
    throw std::invalid_argument(fmt::format(
        "{} is not an instance, expected a number from an answer to \"add\"", value.dump()));
  return value.get<std::uint32_t>();
}

std::vector<KeyValue> key_values(const Json& keys) {
  std::vector<KeyValue> all;
  for (const auto& [key, value] : keys.items()) all.push_back({key, toml_text(key, value)});
  return all;
}

}  // namespace

StreamRequest read_stream_request(const std::string& line) {
  using Kind = StreamRequest::Kind;
  if (line.size() > longest_request) throw std::invalid_argument("the line is longer than 1 MiB");
  Fields fields(json_of<Json>(line, ", expected one object per line"));
  StreamRequest request;
  if (const auto keys = fields.take("set")) {
    if (!keys->is_object() || keys->empty())
      throw std::invalid_argument(
          R"('set' names no key, expected as in {"set": {"sonar.NAME.range_m": 40}})");
    request = {.kind = Kind::set, .keys = key_values(*keys)};
  } else if (const auto object = fields.take("add")) {
    if (!object->is_object())
      throw std::invalid_argument(
          R"('add' is not an object, expected {"add": {"shape": "cylinder"}, "x_m": 1, ...})");
    request = {.kind = Kind::add, .keys = key_values(*object)};
  } else if (const auto moved = fields.take("move")) {
    request = {.kind = Kind::move, .instance = instance_of(*moved)};
  } else if (const auto removed = fields.take("remove")) {
    request = {.kind = Kind::remove, .instance = instance_of(*removed)};
  }
  if (request.kind != Kind::set && request.kind != Kind::remove) request.pose = fields.pose();
  fields.finish();
  return request;
}

}  // namespace ensonify::engine::app
