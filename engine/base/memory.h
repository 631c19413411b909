#pragma once

#include <new>
#include <string_view>
#include <utility>

#include <ensonify/refine/error.h>

namespace ensonify::engine {

/// Not enough memory. The message names what needs it, how much, the limit, and what to change.
struct MemoryError : Error {
  using Error::Error;
};

/// How much memory, in bytes, this process can still allocate: what the machine has available (swap
/// included), or less if a control group or RLIMIT_AS allows less. Infinite if none can be read.
double available_memory_bytes();

/// How much memory a process may use.
struct MemoryLimit {
  double bytes = 0.0;  ///< for the whole process; 0: what is available when it is checked

  /// Throws MemoryError unless `more_bytes` more fit. Stages call it before they allocate. `what`
  /// names, in the plural, what needs the bytes; `remedy` says how to need fewer.
  void require(double more_bytes, std::string_view what, std::string_view remedy) const;
};

/// Throws MemoryError for a std::bad_alloc thrown while `what` was being made.
[[noreturn]] void throw_out_of_memory(std::string_view what);

/// Returns work(); if memory runs out, throws MemoryError naming `what`.
template <class Work>
decltype(auto) with_memory_for(std::string_view what, Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const std::bad_alloc&) {
    throw_out_of_memory(what);
  }
}

}  // namespace ensonify::engine
