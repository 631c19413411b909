#pragma once

/// Before Highway: what the kernels are compiled for. All do the same operations on each number,
/// fused multiply-adds included, so their results are the same to the last bit; targets without
/// fused ones are left out, down to plain code with std::fma.

#define HWY_BROKEN_EMU128 1  // so that plain code is the last resort with any compiler
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_SSE4 | HWY_EMU128 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
