#pragma once

#include <cmath>

namespace ensonify::scatter {

/// Decibels of a power ratio (intensity, cross-section); -inf for zero.
inline double to_db(double power_ratio) { return 10.0 * std::log10(power_ratio); }

/// The power ratio of a level in decibels.
inline double from_db(double level_db) { return std::pow(10.0, level_db / 10.0); }

/// Decibels of an amplitude ratio (pressure, samples); -inf for zero.
inline double amplitude_to_db(double amplitude_ratio) { return 20.0 * std::log10(amplitude_ratio); }

/// The amplitude ratio of a level in decibels.
inline double amplitude_from_db(double level_db) { return std::pow(10.0, level_db / 20.0); }

}  // namespace ensonify::scatter
