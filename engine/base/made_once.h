#pragma once

#include <atomic>
#include <memory>
#include <type_traits>

namespace ensonify::engine {

/// The constant that the function `make` returns, made at the first call and kept until the process
/// ends.
///
/// It stands for a static variable of a function, whose making other threads wait for. In the child
/// of a fork() they would wait without end, if a thread of the parent was making it. Here no
/// thread waits: those that come at the same time each make the constant, and the first is kept.
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
