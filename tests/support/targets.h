#pragma once

#include <cstdint>

#include <hwy/targets.h>

#include "support/catch.h"

namespace ensonify::tests {

/// Calls `check()` with the kernels held to one Highway target after another: all that this
/// machine can run, plain numbers included. Where a kernel is not compiled for one, it takes plain
/// numbers.
template <class Check>
void on_each_target(const Check& check) {
  struct Release {
    ~Release() { hwy::SetSupportedTargetsForTest(0); }
  } release;
  int count = 0;
  for (std::int64_t rest = hwy::SupportedTargets(); rest != 0; rest &= rest - 1, ++count) {
    const std::int64_t target = rest & -rest;
    CAPTURE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    check();
  }
  CHECK(count >= 2);
}

}  // namespace ensonify::tests
