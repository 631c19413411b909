#pragma once

#include <chrono>

namespace ensonify::engine {

/// The clock for durations. Durations are in reports, but never in files of results.
using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Adds the time between two laps to the time of a stage.
class StopWatch {
 public:
  void lap(double& stage_s) {
    const Clock::time_point now = Clock::now();
    stage_s += std::chrono::duration<double>(now - since_).count();
    since_ = now;
  }

 private:
  Clock::time_point since_ = Clock::now();
};

}  // namespace ensonify::engine
