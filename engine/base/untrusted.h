#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace ensonify::engine {

// Checks of files and requests whose content is not trusted.

/// The largest size of a JSON file that is read, in bytes: about 50,000 targets. In memory the JSON
/// takes about ten times as much.
inline constexpr std::uintmax_t most_json_bytes = std::uintmax_t{1} << 27;

/// Whether a path lies in a folder or below it, after links are followed. Both must exist.
bool lies_below(const std::filesystem::path& path, const std::filesystem::path& folder);

/// Whether a path stays inside the folder that it is relative to.
bool stays_inside(const std::filesystem::path& path);

/// The largest number of levels (lists, objects and tables inside each other) that an untrusted
/// text may have. Copying, writing or freeing it takes stack for each level.
inline constexpr int most_levels = 64;

/// The byte at which a JSON text exceeds most_levels; none if it does not.
std::optional<std::size_t> too_deep_in_json(std::string_view json);

/// The byte at which one statement of a TOML text exceeds most_levels; none if no statement does. A
/// statement is a [table], or a key with its value; each dot of a key is a level, too.
std::optional<std::size_t> too_deep_in_toml(std::string_view toml);

/// The JSON of a text. The engine parses JSON only with this function. Throws
/// std::invalid_argument, with the position of the fault in bytes and with `expected`, if the text
/// is not JSON or has more than `most_levels` levels.
template <typename Json>
Json json_of(std::string_view text, std::string_view expected = "") {
  const auto fault = [&](const std::string& what) {
    return std::invalid_argument("this " + what + std::string(expected));
  };
  if (const std::optional byte = too_deep_in_json(text))
    throw fault("JSON has lists or objects more than " + std::to_string(most_levels) +
                " levels deep, from byte " + std::to_string(*byte + 1) + " on");
  try {
    return Json::parse(text);
  } catch (const typename Json::parse_error& error) {
    throw fault("is not JSON (which has no NaN or infinity), from byte " +
                std::to_string(error.byte) + " on");
  } catch (const typename Json::out_of_range&) {
    throw fault("is not JSON: one of its numbers is too large");
  }
}

/// The JSON of a text, for a file that may be damaged; null if json_of() throws.
template <typename Json>
Json json_or_null(std::string_view text) {
  try {
    return json_of<Json>(text);
  } catch (const std::invalid_argument&) {
    return {};
  }
}

/// What is wrong with the content of a JSON file: the message of an exception, without the name and
/// number at the beginning of messages of nlohmann's library.
inline std::string fault_in_json(const std::exception& error) {
  const std::string_view message = error.what();
  const bool named = message.starts_with("[json.exception.");
  return std::string(message.substr(named ? message.find("] ") + 2 : 0));
}

/// Returns `json` if it is a whole number from 0 to `most`, or if all numbers in its lists and
/// objects are. Throws std::out_of_range otherwise. (For other numbers, nlohmann's get<T>() returns
/// a wrong number or has undefined behaviour.)
template <typename Json>
const Json& whole_numbers(const Json& json,
                          std::uint64_t most = std::numeric_limits<std::uint64_t>::max()) {
  if (json.is_structured())
    for (const Json& value : json) whole_numbers(value, most);
  else if (json.is_number() &&
           !(json.is_number_unsigned() && json.template get<std::uint64_t>() <= most))
    throw std::out_of_range(json.dump() + " is not a whole number from 0 to " +
                            std::to_string(most));
  return json;
}

}  // namespace ensonify::engine
