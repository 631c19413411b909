#pragma once

/// Include before Highway: sets the targets that kernels are compiled for. All targets do the same
/// operations on each number, fused multiply-adds included, so results are equal to the last bit.
/// Targets without fused operations are disabled, except plain code with std::fma.

#define HWY_BROKEN_EMU128 1  // plain code is the fallback with any compiler
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_SSE4 | HWY_EMU128 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
