#pragma once

#include <algorithm>

namespace ensonify::engine {

// The leakage of the transmitted pulse into the receiver, over OtherPathsOptions::burst_m: full
// scale and 30 dB more within that range, then 60 dB less for each further burst_m.

constexpr double burst_peak_db = 30.0, burst_decay_db = 60.0;
constexpr double longest_burst = 3.0;  ///< in lengths of burst_m; later there is none

/// Its level over full scale, dB, at a range in lengths of burst_m.
inline double burst_level_db(double lengths) {
  return burst_peak_db - burst_decay_db * std::max(lengths - 1.0, 0.0);
}

/// The range, in lengths of burst_m, from which on it is below a level over full scale, dB.
inline double burst_lengths(double level_db) {
  return std::clamp(1.0 + (burst_peak_db - level_db) / burst_decay_db, 1.0, longest_burst);
}

}  // namespace ensonify::engine
