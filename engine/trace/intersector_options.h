#pragma once

#include <string>

namespace ensonify::engine {

/// How a back-end is made. What a back-end has no use for, it ignores.
struct IntersectorOptions {
  /// Whether rays that meet an edge or a corner are held there at some cost in speed (Embree's
  /// robust mode); the exact back-ends always hold them.
  bool robust = true;
  /// The trees are for one ping each, of one thread: built fast rather than traced fast.
  bool for_one_ping = false;
  /// What the last bits of a back-end in float may depend on, the name of an instruction set (see
  /// instruction_sets in embree.h); empty: the best that all machines of the last ten years have.
  std::string instruction_set;

  IntersectorOptions of_one_ping() const {
    IntersectorOptions same = *this;
    same.for_one_ping = true;
    return same;
  }
};

}  // namespace ensonify::engine
