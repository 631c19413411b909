#pragma once

#include <atomic>

namespace ensonify::engine {

/// Counts the calls of an object's functions, so that the child of a fork() does not use an object
/// in which a thread of its parent was: that thread is not in the child, what it was doing is half
/// done, and what it has locked stays locked.
class CallsAtFork {
 public:
  CallsAtFork();

  /// One call, while it lasts. Throws std::runtime_error in such a child.
  class Call {
   public:
    explicit Call(CallsAtFork& of);
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

   private:
    CallsAtFork& of_;
    bool counted_;
  };

 private:
  const int made_by_;          // the process
  std::atomic<int> calls_{0};  // of that process; in a child, those at the fork
};

}  // namespace ensonify::engine
