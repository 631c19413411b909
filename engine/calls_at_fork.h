#pragma once

#include <unistd.h>

#include <atomic>
#include <stdexcept>

namespace ensonify::engine {

/// Counts the calls of an object's functions, so that the child of a fork() does not use an object
/// in which a thread of its parent was: that thread is not in the child, what it was doing is half
/// done, and what it has locked stays locked.
class CallsAtFork {
 public:
  /// One call, while it lasts. Throws std::runtime_error in such a child.
  class Call {
   public:
    explicit Call(CallsAtFork& of) : of_(of), counted_(getpid() == of.made_by_) {
      if (counted_)
        ++of_.calls_;
      else if (of_.calls_ > 0)
        throw std::runtime_error(
            "another thread was in a call of this Simulator when this process was forked; make a "
            "Simulator after the fork, or fork while no thread calls it");
    }
    ~Call() {
      if (counted_) --of_.calls_;
    }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

   private:
    CallsAtFork& of_;
    bool counted_;
  };

 private:
  const pid_t made_by_ = getpid();
  std::atomic<int> calls_ =
      0;  // of the process that made the object; in a child, those at the fork
};

}  // namespace ensonify::engine
