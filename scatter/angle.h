#pragma once

#include <numbers>

namespace ensonify::scatter {

inline constexpr double degree = std::numbers::pi / 180.0;  ///< in radians

}  // namespace ensonify::scatter
