#pragma once

#include <new>
#include <string_view>
#include <utility>

#include <ensonify/refine/error.h>

namespace ensonify::engine {

/// A scene needs more memory than there is: what needs it, how much, the limit and the cure.
struct MemoryError : Error {
  using Error::Error;
};

/// How much memory this process can still take: what the machine has available (swap included), or
/// less where a control group or RLIMIT_AS leaves less. Infinite where none of them can be read.
double available_memory_bytes();

/// How much memory a process may use.
struct MemoryLimit {
  double bytes = 0.0;  ///< of the whole process; 0: what is available, looked up when it is needed

  /// Throws MemoryError unless that many more bytes fit. For stages to call before they allocate.
  /// `what` names in the plural what needs the bytes, `cure` how to need fewer.
  void require(double more_bytes, std::string_view what, std::string_view cure) const;
};

/// Throws MemoryError for a std::bad_alloc that was caught while `what` was made.
[[noreturn]] void throw_out_of_memory(std::string_view what);

/// Does the work; where memory runs out the message names what was being made.
template <class Work>
decltype(auto) with_memory_for(std::string_view what, Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const std::bad_alloc&) {
    throw_out_of_memory(what);
  }
}

}  // namespace ensonify::engine
