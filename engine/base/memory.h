#pragma once

#include <new>
#include <string_view>
#include <utility>

#include <ensonify/refine/error.h>

namespace ensonify::engine {

/// There is not enough memory. The message states what needs memory, how much it needs, the limit,
/// and what to change.
struct MemoryError : Error {
  using Error::Error;
};

/// The bytes that this process can still allocate: what the machine has available, with swap, or
/// less if a control group or RLIMIT_AS allows less. Infinite if none of these can be read.
double available_memory_bytes();

/// How much memory a process may use.
struct MemoryLimit {
  double bytes = 0.0;  ///< for the whole process; 0: what is available when it is checked

  /// Throws MemoryError if `more_bytes` additional bytes do not fit. Called before memory is
  /// allocated. `what` is a plural noun for what needs them; `remedy` states how to need fewer.
  void require(double more_bytes, std::string_view what, std::string_view remedy) const;
};

/// Throws the MemoryError that replaces a std::bad_alloc thrown while `what` was being made.
[[noreturn]] void throw_out_of_memory(std::string_view what);

/// Returns work(). If memory runs out, throws a MemoryError that names `what`.
template <class Work>
decltype(auto) with_memory_for(std::string_view what, Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const std::bad_alloc&) {
    throw_out_of_memory(what);
  }
}

}  // namespace ensonify::engine
