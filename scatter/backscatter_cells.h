#pragma once

/// The layout of BackscatterTable's values, for kernels: over the squared tangent of the grazing
/// angle, in equal cells between each two powers of two, from `lowest` on.
namespace ensonify::scatter::backscatter_cells {

inline constexpr double lowest = 0x1p-28;        ///< a grazing angle of 0.0035 degrees
inline constexpr double highest = 0x1p+24;       ///< 0.014 degrees from vertical
inline constexpr int cells_per_octave_bits = 6;  ///< 2^6 cells between two powers of two

}  // namespace ensonify::scatter::backscatter_cells
