#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

namespace ensonify::refine {

/// Threads of a parallel_for that have no item left, at the service of those that have.
class SpareThreads {
 public:
  /// Work that may be done meanwhile, time and again. One thread owns it; it may outlive the loop.
  class BackgroundTask {
   public:
    /// The work must not throw.
    explicit BackgroundTask(std::function<void()> work) : work_(std::move(work)) {}
    ~BackgroundTask() { finish(); }
    BackgroundTask(const BackgroundTask&) = delete;
    BackgroundTask& operator=(const BackgroundTask&) = delete;

    /// Has a spare thread do it, if there is one. Not while it is out.
    void send(SpareThreads& threads);
    /// Whether it was sent, and nothing was asked since.
    bool is_out() const { return state_ != State::idle; }
    /// Waits for whoever does it, or takes it back where nobody has begun. Whether it is done.
    bool finish();

   private:
    friend SpareThreads;
    enum class State { idle, offered, running, done };
    std::function<void()> work_;
    SpareThreads* threads_ = nullptr;
    std::atomic<State> state_ = State::idle;
  };

  /// Whether one of them has nothing to do just now.
  bool any() const { return idle_ > 0; }

  /// For parallel_for: its calling thread goes to its items, and then has none left and serves
  /// until no thread is at its items.
  void begin_items();
  void serve();

 private:
  std::mutex mutex_;
  std::condition_variable offered_or_over_, done_;
  std::vector<BackgroundTask*> offered_;  // each has an idle thread to itself
  std::atomic<int> idle_ = 0;             // threads, those apart
  int at_items_ = 0;
};

}  // namespace ensonify::refine
