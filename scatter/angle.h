#pragma once

#include <numbers>

namespace ensonify::scatter {

inline constexpr double degree = std::numbers::pi / 180.0;  ///< one degree in radians

}  // namespace ensonify::scatter
