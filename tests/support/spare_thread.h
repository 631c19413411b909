#pragma once

#include <thread>

#include <ensonify/refine/spare_threads.h>

namespace ensonify::tests {

/// One spare thread as long as this lives, as of a loop in which the caller is at an item.
class SpareThread {
 public:
  SpareThread() {
    threads.begin_items();
    helper_ = std::thread([this] {
      threads.begin_items();
      threads.serve();
    });
    settle();
  }
  ~SpareThread() {
    threads.serve();
    helper_.join();
  }
  /// Until it has nothing to do.
  void settle() const {
    while (!threads.any()) std::this_thread::yield();
  }

  refine::SpareThreads threads;

 private:
  std::thread helper_;
};

}  // namespace ensonify::tests
