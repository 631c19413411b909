#pragma once

#include <atomic>
#include <memory>
#include <type_traits>

namespace ensonify::engine {

/// Returns the constant that the function `make` makes. It is made at the first call and exists
/// until the process ends.
///
/// It replaces a static variable of a function. While one thread makes such a variable, other
/// threads wait for it. In the child of a fork(), they would wait without end if a thread of the
/// parent was making it. Here no thread waits: threads that come at the same time each make the
/// constant, and the first one is kept.
template <auto make>
const std::invoke_result_t<decltype(make)>& made_once() {
  using Constant = const std::invoke_result_t<decltype(make)>;
  static constinit std::atomic<Constant*> kept{nullptr};
  Constant* constant = kept.load(std::memory_order_acquire);
  if (!constant) {
    auto made = std::make_unique<Constant>(make());
    if (kept.compare_exchange_strong(constant, made.get(), std::memory_order_acq_rel))
      constant = made.release();
  }
  return *constant;
}

}  // namespace ensonify::engine
