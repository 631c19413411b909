#pragma once

#include <chrono>

namespace ensonify::engine {

/// What durations are measured by. They go into reports, never into files.
using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Adds the time since the last lap to a stage.
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
