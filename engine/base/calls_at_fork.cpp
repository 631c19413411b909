#include <ensonify/engine/base/calls_at_fork.h>

#include <unistd.h>

#include <stdexcept>

namespace ensonify::engine {

CallsAtFork::CallsAtFork() : made_by_(getpid()) {}

CallsAtFork::Call::Call(CallsAtFork& of) : of_(of), counted_(getpid() == of.made_by_) {
  if (counted_)
    ++of_.calls_;
  else if (of_.calls_ > 0)
    throw std::runtime_error(
        "another thread was in a call of this Simulator when this process was forked; make a "
        "Simulator after the fork, or fork while no thread calls it");
}

CallsAtFork::Call::~Call() {
  if (counted_) --of_.calls_;
}

}  // namespace ensonify::engine
