#pragma once

#include <cmath>

namespace ensonify::scatter {

/// Decibels of a power ratio (intensity, cross-section); -inf for zero.
inline double to_db(double power_ratio) { return 10.0 * std::log10(power_ratio); }

/// The power ratio of a level in decibels.
inline double from_db(double level_db) { return std::pow(10.0, level_db / 10.0); }

}  // namespace ensonify::scatter
