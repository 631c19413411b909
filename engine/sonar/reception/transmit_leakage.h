#pragma once

#include <algorithm>

namespace ensonify::engine {

// The leakage of the transmitted pulse into the receiver, over OtherPathsOptions::burst_m: full
// scale and 30 dB more within that range, then 60 dB less for each further burst_m.

constexpr double leakage_peak_db = 30.0, leakage_decay_db = 60.0;
constexpr double longest_leakage = 3.0;  ///< in lengths of burst_m; later there is none

/// Its level over full scale, dB, at a range in lengths of burst_m.
inline double leakage_level_db(double lengths) {
  return leakage_peak_db - leakage_decay_db * std::max(lengths - 1.0, 0.0);
}

/// The range, in lengths of burst_m, from which on it is below a level over full scale, dB.
inline double leakage_lengths(double level_db) {
  return std::clamp(1.0 + (leakage_peak_db - level_db) / leakage_decay_db, 1.0, longest_leakage);
}

}  // namespace ensonify::engine
