#pragma once

#include <functional>
#include <string>

namespace ensonify::engine {

/// How a back-end is made. A back-end ignores options that it does not use.
struct IntersectorOptions {
  /// Embree's robust mode: far fewer rays slip through an edge or a corner, at some cost in speed
  /// (embree.h). The other back-ends let none through.
  bool robust = true;
  /// Each tree is for one ping and one thread, so it is made to be built fast, not to be traced
  /// fast.
  bool for_one_ping = false;
  /// The instruction set that the last bits of a float back-end may depend on (see
  /// instruction_sets in embree.h); empty: the best that all machines of the last ten years have.
  std::string instruction_set;
  /// Called repeatedly during a long query, and by the exact back-ends also during build(). Any
  /// thread may call it. An exception that it throws ends the query or the build.
  std::function<void()> stop_check = {};

  IntersectorOptions of_one_ping() const {
    IntersectorOptions same = *this;
    same.for_one_ping = true;
    return same;
  }
};

}  // namespace ensonify::engine
