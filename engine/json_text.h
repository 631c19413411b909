#pragma once

#include <string>

namespace ensonify::engine {

/// JSON as UTF-8 text, on one line or indented. Invalid UTF-8 (for example in file names) becomes
/// U+FFFD; dump() alone would throw.
template <typename Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

/// The same on one line, with other characters than ASCII as \u and four digits.
template <typename Json>
std::string ascii_json_text(const Json& json) {
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

}  // namespace ensonify::engine
