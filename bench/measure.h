#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "cases.h"

namespace ensonify::bench {

/// The middle of several measurements, and how far they spread.
struct Spread {
  double median = 0.0;
  double lowest = 0.0;
  double highest = 0.0;
};
Spread spread_of(std::vector<double> values);

/// What was measured of a case, on one thread. Milliseconds a ping.
struct Measurement {
  std::string name;
  std::size_t faces = 0;
  double rays_per_ping = 0.0;
  double prepare_s = 0.0;  ///< seafloor and surface, once
  Spread ping_ms;          ///< a whole ping, files apart
  double surface_ms = 0.0, trace_ms = 0.0, echo_ms = 0.0, speckle_ms = 0.0;  ///< means
  std::string code_path;
};

/// Times the cases in turns, round after round, so that a change of the machine's pace meets all of
/// them: a spread is over rounds of `pings` pings each.
std::vector<Measurement> measure(const std::vector<Case>& cases, int rounds, int pings);

}  // namespace ensonify::bench
