#pragma once

#include <span>

#include "clock.h"
#include "grid.h"
#include "spread.h"

namespace ensonify::bench {

constexpr int turn_pings = 8;  // the most that a query serves

/// The thread time of a turn, in seconds: ping(0) to ping(7).
template <class Ping>
double turn_s(const Ping& ping) {
  const double start_s = thread_s();
  for (int i = 0; i < turn_pings; ++i) ping(i);
  return thread_s() - start_s;
}

/// The time that the measurement itself adds.
struct Harness {
  /// Time of an empty turn: the loop, the loop's clock calls and the stages' clock calls.
  double ping_us = 0.0;
  double fastest_ping_us = 0.0;  ///< of the grid's cells
  double share() const { return ping_us / fastest_ping_us; }
  static constexpr double max_share = 0.01;
  /// The share of the cells' ping times that the times of the stages add up to.
  Spread stages_over_ping;
  /// Stages are in wall time, pings in thread time: they differ where other programs ran.
  bool stages_are_of_pings() const {
    return stages_over_ping.median > 0.95 && stages_over_ping.median < 1.05;
  }
};

/// At least one of the cells must have been timed.
Harness measure_harness(std::span<const Cell> cells);

}  // namespace ensonify::bench
