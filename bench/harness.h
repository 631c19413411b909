#pragma once

#include <span>

#include "clock.h"
#include "grid.h"
#include "spread.h"

namespace ensonify::bench {

constexpr int turn_pings = 8;  // as many as a query may do for

/// Seconds of this thread's own that a turn takes: ping(0) to ping(7).
template <class Ping>
double turn_s(const Ping& ping) {
  const double start_s = thread_s();
  for (int i = 0; i < turn_pings; ++i) ping(i);
  return thread_s() - start_s;
}

/// What measuring itself adds to what is measured.
struct Harness {
  double ping_us =
      0.0;  ///< of a turn with nothing in it: the loop, its clock calls, and those of the stages
  double fastest_ping_us = 0.0;  ///< of the grid's cells
  double share() const { return ping_us / fastest_ping_us; }
  static constexpr double max_share = 0.01;
  Spread stages_over_ping;  ///< of the cells: how much of their pings the times of the stages
                            ///< account for
};

/// For cells of which one was timed at least.
Harness measure_harness(std::span<const Cell> cells);

}  // namespace ensonify::bench
