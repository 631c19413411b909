#pragma once

#include <cstddef>
#include <cstdint>

namespace ensonify::engine {

/// How many bins a group has; arrays of the kernels are padded to whole groups.
inline constexpr std::size_t signal_group = 16;

/// What the sums over scatterers read and write, as plain arrays: the loops are compiled once for each kind of
/// vector register, and must share no inline function with the rest of the program. All do the same
/// operations on each number, without fused ones: the results are the same to the last bit.
struct CellSums {
  // Of each bin:
  const std::uint32_t* across_cell;    ///< its cell across the look, and
  const std::uint32_t* across_within;  ///< how far in it, in 2^-32
  const std::uint32_t* first_cell;     ///< along the array
  const float* first_column;  ///< where that begins, in the table's columns from the beam's middle
  const std::uint32_t* first_weight;  ///< of its row of the table
  const std::uint32_t* key;
  const float* turns;  ///< of phase over a cell across
  // Of each group:
  const std::uint32_t* cells;  ///< how many along the array, at most
  std::size_t bins;            ///< a multiple of signal_group
  // The table:
  const float* weights;  ///< real and imaginary part
  float columns_per_cell;
  std::uint32_t last_column;  ///< weighs nothing, like all beyond
  // Out, a value a bin:
  float* re;
  float* im;
};

/// Sums of the scatterers' complex normal strengths times weight and phase, over the root of the sum of
/// the weights' squares.
void sum_cells(const CellSums& sums);

/// Complex normal numbers of variance 1: the same for the same key and place in the array.
void draw_complex_normal(std::uint32_t key, std::size_t count, float* re, float* im);

/// out[n] = sum over |d| <= reach of taps[|d|] * in[n + d]; in has `reach` more on either side.
void convolve(const float* taps, std::size_t reach, const float* in, std::size_t count, float* out);

}  // namespace ensonify::engine
