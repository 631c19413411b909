#pragma once

#include <atomic>

namespace ensonify::engine {

/// Counts the calls of an object's functions that are not finished, for the case of a fork(). If a
/// thread of the parent was in such a call, the child does not have this thread: its work stays
/// half done, and its locks stay locked. So the child must not use the object.
class CallsAtFork {
 public:
  CallsAtFork();

  /// Exists while a call lasts. Its constructor throws std::runtime_error in such a child.
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
  const int made_by_;          // the process that made the object
  std::atomic<int> calls_{0};  // unfinished ones; in a child, those at the fork
};

}  // namespace ensonify::engine
