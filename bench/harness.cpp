#include "harness.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <ensonify/engine/base/clock.h>
#include <ensonify/engine/stage_times.h>

namespace ensonify::bench {
namespace {

/// The clock calls of Simulator::ping() for one sonar with two sides.
void empty_ping(engine::StageTimes& times) {
  engine::StopWatch watch;
  watch.lap(times.surface_s);
  for (int side = 0; side < 2; ++side) {
    watch.lap(times.trace_s);
    watch.lap(times.echo_s);
  }
  watch.lap(times.receive_s);
}

}  // namespace

Harness measure_harness(std::span<const Cell> cells) {
  constexpr int rounds = 21, turns = 200;
  engine::StageTimes times;
  std::vector<double> ping_us;
  for (int round = 0; round < rounds; ++round) {
    const double start_s = thread_s();
    for (int turn = 0; turn < turns; ++turn) turn_s([&](int) { empty_ping(times); });
    ping_us.push_back(1e6 * (thread_s() - start_s) / (turns * turn_pings));
  }
  Harness harness{.ping_us = spread_of(std::move(ping_us)).median,
                  .fastest_ping_us = std::numeric_limits<double>::infinity()};
  std::vector<double> stages;
  for (const Cell& cell : cells) {
    if (cell.ping_ms.median == 0.0) continue;  // not timed
    harness.fastest_ping_us = std::min(harness.fastest_ping_us, 1e3 * cell.ping_ms.median);
    stages.push_back(cell.stages_over_ping);
  }
  harness.stages_over_ping = spread_of(std::move(stages));
  return harness;
}

}  // namespace ensonify::bench
