#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

namespace ensonify::refine {

/// The threads of a parallel_for that have no item left; they do background tasks for the others.
class SpareThreads {
 public:
  /// Work that a spare thread may do, once per send(). One thread owns it; it may outlive the loop.
  class BackgroundTask {
   public:
    /// The work must not throw.
    explicit BackgroundTask(std::function<void()> work) : work_(std::move(work)) {}
    ~BackgroundTask() { finish(); }
    BackgroundTask(const BackgroundTask&) = delete;
    BackgroundTask& operator=(const BackgroundTask&) = delete;

    /// Offers the work to a spare thread, if one is free. Does nothing while is_out().
    void send(SpareThreads& threads);
    /// Whether send() was called, and finish() was not called after it.
    bool is_out() const { return state_ != State::idle; }
    /// Whether a thread is doing the work, so that finish() would wait.
    bool is_running() const { return state_ == State::running; }
    /// Waits for the work if a thread has started it, otherwise withdraws it. Returns whether it is
    /// done.
    bool finish();

   private:
    friend SpareThreads;
    enum class State { idle, offered, running, done };
    std::function<void()> work_;
    SpareThreads* threads_ = nullptr;
    std::atomic<State> state_ = State::idle;
  };

  /// Whether a spare thread is free now.
  bool any() const { return idle_ > 0; }

  /// For parallel_for: each of its threads calls begin_items() before its items and serve() after
  /// them. serve() runs tasks until no thread has items.
  void begin_items();
  void serve();

 private:
  std::mutex mutex_;
  std::condition_variable offered_or_over_, done_;
  std::vector<BackgroundTask*> offered_;  // each has one idle thread reserved
  std::atomic<int> idle_ = 0;             // threads without a reserved task
  int at_items_ = 0;
};

}  // namespace ensonify::refine
