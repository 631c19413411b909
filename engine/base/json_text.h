#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>

namespace ensonify::engine {

/// JSON as UTF-8 text, on one line or indented. Invalid UTF-8 (for example in file names) becomes
/// U+FFFD; nlohmann's dump() would throw without this.
template <typename Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

/// JSON on one line in ASCII: other characters become \u and four digits.
template <typename Json>
std::string ascii_json_text(const Json& json) {
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

/// Whether a JSON value is also TOML. TOML has no null and writes tables in another way.
template <typename Json>
bool is_toml(const Json& value) {
  if (value.is_array()) return std::ranges::all_of(value, is_toml<Json>);
  return !value.is_null() && !value.is_object();
}

/// A JSON value of a scene's key as TOML. Throws std::invalid_argument if !is_toml(value).
template <typename Json>
std::string toml_text(const std::string& key, const Json& value) {
  if (is_toml(value)) return json_text(value);
  throw std::invalid_argument("'" + key + "' is " + json_text(value) +
                              ", expected a number, a text, true, false or a list of such");
}

}  // namespace ensonify::engine
