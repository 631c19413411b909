#pragma once

#include <cstdint>
#include <functional>

namespace ensonify::engine {

/// How a long computation is done. The result is the same with any number of threads.
struct WorkControl {
  int threads = 1;  ///< the largest number of threads
  /// Called often, by any thread. An exception that it throws ends the work.
  std::function<void()> stop_check = {};

  void check_stop() const {
    if (stop_check) stop_check();
  }
};

/// Calls a stop check from an inner loop, at one of 65,536 calls.
class RareStopCheck {
 public:
  explicit RareStopCheck(const std::function<void()>& stop_check) : stop_check_(stop_check) {}
  void operator()() {
    if (++calls_ % 65536 == 0 && stop_check_) stop_check_();
  }

 private:
  const std::function<void()>& stop_check_;
  std::uint32_t calls_ = 0;
};

}  // namespace ensonify::engine
