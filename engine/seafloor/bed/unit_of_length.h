#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include <ensonify/engine/base/lower_case.h>

namespace ensonify::engine {

/// Whether a file's unit, in any case, is the metre; so is one that is not stated.
inline bool is_metre(std::string_view unit) {
  constexpr std::array<std::string_view, 6> names = {"", "m", "metre", "metres", "meter", "meters"};
  return std::ranges::find(names, lower_case(std::string(unit))) != names.end();
}

}  // namespace ensonify::engine
