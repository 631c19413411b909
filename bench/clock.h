#pragma once

#include <ctime>

namespace ensonify::bench {

inline double seconds(clockid_t clock) {
  timespec time;
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// This thread's CPU time, which excludes other programs.
inline double thread_s() { return seconds(CLOCK_THREAD_CPUTIME_ID); }
inline double wall_s() { return seconds(CLOCK_MONOTONIC); }

}  // namespace ensonify::bench
