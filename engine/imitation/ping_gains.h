#pragma once

#include <vector>

#include <ensonify/engine/comparison/find_bed.h>
#include <ensonify/engine/imitation/recorder_signs.h>

namespace ensonify::engine {

/// How the gain of a line changes from ping to ping.
struct PingGains {
  double rms_db = 0.0;          ///< as ReceiverOptions::ping_gain_db
  std::vector<double> factors;  ///< of the amplitude, by ping; empty: no change was found
};

/// Finds how the gain changes. A higher gain makes the near half and the far half of a ping's bed
/// brighter together, on both sides. Speckle and the bed change the halves separately. So the
/// covariance of the two halves' changes from ping to ping is the variance by the gain alone.
/// Changes below 3 % are ignored, as are recorders with an automatic gain.
PingGains ping_gains(const LineWithBed& line, const RecorderSigns& recorder);

/// The line as it would be without these changes of the gain.
LineWithBed without_ping_gains(const LineWithBed& line, const PingGains& gains,
                               const RecorderSigns& recorder);

}  // namespace ensonify::engine
