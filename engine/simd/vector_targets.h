#pragma once

/// Include before Highway: sets the targets that kernels are compiled for. Without fused operations
/// there is only plain code, which has std::fma: so all targets do the same operations on each
/// number, and results are equal to the last bit. lanes-inl.h refuses a target that rounds twice or
/// whose registers have no fixed size, should a new Highway have another one.
///
/// A kernel that uses no fused operations defines ENSONIFY_NO_FMA before: it takes older targets,
/// too.

#define HWY_BROKEN_EMU128 1  // plain code is the fallback with any compiler
#define ENSONIFY_UNFIT_TARGETS (HWY_EMU128 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)

#ifdef ENSONIFY_NO_FMA
#define HWY_DISABLED_TARGETS ENSONIFY_UNFIT_TARGETS
#else
// Fused operations came to x86 with AVX2; the bits of older targets lie above its bit.
#define HWY_DISABLED_TARGETS \
  (ENSONIFY_UNFIT_TARGETS | ((1LL << (HWY_HIGHEST_TARGET_BIT_X86 + 1)) - (HWY_AVX2 << 1)))
#endif
