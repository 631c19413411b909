#pragma once

#include <vector>

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/recorder_signs.h>

namespace ensonify::engine {

/// How the gain of a line changes from ping to ping.
struct PingGains {
  double rms_db = 0.0;          ///< as ReceiverOptions::ping_gain_db
  std::vector<double> factors;  ///< on the amplitude, by ping; empty: no such change was found
};

/// A gain makes the near and the far half of a ping's bed brighter together, on both sides. Speckle
/// and the bed itself change them separately. So the covariance of the halves' changes from ping to
/// ping is that of the gain alone. Changes below 3 % are not looked for, nor is the gain of a
/// recorder with an automatic gain.
PingGains ping_gains(const LineWithBed& line, const RecorderSigns& recorder);

/// The line as if it had been recorded without these changes.
LineWithBed without_ping_gains(const LineWithBed& line, const PingGains& gains,
                               const RecorderSigns& recorder);

}  // namespace ensonify::engine
