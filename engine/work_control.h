#pragma once

#include <functional>

namespace ensonify::engine {

/// How a long piece of work is done. Its result is the same on any number of threads.
struct WorkControl {
  int threads = 1;  ///< at most
  /// Called often, by any thread. What it throws ends the work.
  std::function<void()> stop_check = {};

  void check_stop() const {
    if (stop_check) stop_check();
  }
};

}  // namespace ensonify::engine
