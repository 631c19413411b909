#pragma once

#include <thread>

#include <ensonify/refine/spare_threads.h>

namespace ensonify::tests {

/// Provides one spare thread during its lifetime, as in a loop where the caller has an item.
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
  /// Waits until the thread is idle.
  void settle() const {
    while (!threads.any()) std::this_thread::yield();
  }

  refine::SpareThreads threads;

 private:
  std::thread helper_;
};

}  // namespace ensonify::tests
