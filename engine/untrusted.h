#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

namespace ensonify::engine {

// Checks of the content of files and requests that are not trusted.

/// The most bytes of JSON that are read from a file of a folder: some 50,000 targets. In memory
/// they take about ten times as many.
inline constexpr std::uintmax_t most_json_bytes = std::uintmax_t{1} << 27;

/// Whether a path, with its links followed, is in a folder or below it. Both must exist.
bool lies_below(const std::filesystem::path& path, const std::filesystem::path& folder);

/// Whether a path stays inside the folder that it is relative to.
bool stays_inside(const std::filesystem::path& path);

/// Throws std::invalid_argument for JSON with lists or objects more than 64 levels deep. To copy or
/// write such JSON takes stack for each level.
void require_shallow_json(std::string_view json);

/// The same JSON, if it is a whole number from 0 to `most`, or has only such numbers in its lists
/// and objects. Throws std::out_of_range otherwise. (Of another number nlohmann's get<T>() makes
/// any number, or its behaviour is undefined.)
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
