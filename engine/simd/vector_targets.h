#pragma once

/// Include this header before Highway. It chooses the targets that kernels are compiled for: those
/// with fused multiply-add instructions, and plain code, which calls std::fma. So all targets do
/// the same operations on each number, and results are equal to the last bit. If a new Highway has
/// a target that rounds twice or whose registers have no fixed size, lanes-inl.h refuses it.
///
/// A kernel without fused operations defines ENSONIFY_NO_FMA before this header. Then it is
/// compiled for older targets, too.

#define HWY_BROKEN_EMU128 1  // plain code is the fallback with any compiler
#define ENSONIFY_UNFIT_TARGETS (HWY_EMU128 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)

#ifdef ENSONIFY_NO_FMA
#define HWY_DISABLED_TARGETS ENSONIFY_UNFIT_TARGETS
#else
// x86 has fused operations since AVX2. The bits of older targets are above the bit of AVX2.
#define HWY_DISABLED_TARGETS \
  (ENSONIFY_UNFIT_TARGETS | ((1LL << (HWY_HIGHEST_TARGET_BIT_X86 + 1)) - (HWY_AVX2 << 1)))
#endif
