#pragma once

#include <algorithm>

namespace ensonify::engine {

// The leakage of the transmitted pulse into the receiver: 30 dB above full scale up to the range
// OtherPathsOptions::burst_m, then 60 dB less for each further burst_m.

constexpr double leakage_peak_db = 30.0, leakage_decay_db = 60.0;
constexpr double longest_leakage = 3.0;  ///< in units of burst_m; beyond it there is no leakage

/// Its level above full scale, dB, at a range in units of burst_m.
inline double leakage_level_db(double lengths) {
  return leakage_peak_db - leakage_decay_db * std::max(lengths - 1.0, 0.0);
}

/// The range, in units of burst_m, from which on the leakage is below a level, dB above full scale.
inline double leakage_lengths(double level_db) {
  return std::clamp(1.0 + (leakage_peak_db - level_db) / leakage_decay_db, 1.0, longest_leakage);
}

}  // namespace ensonify::engine
