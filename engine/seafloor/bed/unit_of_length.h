#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include <ensonify/engine/base/lower_case.h>

namespace ensonify::engine {

/// Whether a unit in a file, in upper or lower case, is the metre. An empty unit counts as metre.
inline bool is_metre(std::string_view unit) {
  constexpr std::array<std::string_view, 6> names = {"", "m", "metre", "metres", "meter", "meters"};
  return std::ranges::find(names, lower_case(std::string(unit))) != names.end();
}

}  // namespace ensonify::engine
