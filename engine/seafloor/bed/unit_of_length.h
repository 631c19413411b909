#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>

namespace ensonify::engine {

/// Whether a file's unit, in any case, is the metre; so is one that is not stated.
inline bool is_metre(std::string_view unit) {
  constexpr std::array<std::string_view, 6> names = {"", "m", "metre", "metres", "meter", "meters"};
  std::string lower(unit);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::ranges::find(names, lower) != names.end();
}

}  // namespace ensonify::engine
