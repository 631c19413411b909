#pragma once

#include <cstddef>
#include <cstdint>

namespace ensonify::engine {

/// How many bins a group has; what kernels write, and what they read a value a bin, has room for
/// whole groups.
inline constexpr std::size_t signal_group = 16;
constexpr std::size_t whole_groups(std::size_t bins) {
  return (bins + signal_group - 1) / signal_group * signal_group;
}

// What the loops read and write, as plain arrays: they are compiled once for each kind of vector
// register, and must share no inline function with the rest of the program. All do the same
// operations on each number, without fused ones: the results are the same to the last bit.

/// Where the scatterers' cells lie that each bin hears.
struct CellPlaces {
  std::size_t bins;
  // Of each bin:
  const float* intensity;  ///< above 0, or it hears none
  const float* x_m;
  const float* y_m;
  const float* z_m;
  const float* range_m;
  const float* cells_per_m;  ///< along the array
  const float* reach;        ///< cells to either side
  // The frame:
  double across[3];   ///< what a place's parts weigh across the look,
  double along[3];    ///< and along the array, less the listener's,
  double along_from;  ///< this
  double across_from;
  double across_cells_per_m, turns, rise, columns_per_cell;
  // Out, of each bin:
  std::uint32_t* across_cell;    ///< its cell across the look, and
  std::uint32_t* across_within;  ///< how far in it, in 2^-32
  std::uint32_t* first_cell;     ///< along the array
  float* first_column;  ///< where that begins, in the table's columns from the beam's middle
  float* phase_turns;   ///< of phase over a cell across
  // Out, of each group:
  std::uint32_t* cells;      ///< how many along the array, at most
  std::uint32_t* placeless;  ///< not 0: it has bins with an echo from nowhere, at the origin
};
void place_cells(const CellPlaces& places);

/// What the sums over scatterers read and write.
struct CellSums {
  // Of each bin:
  const std::uint32_t* across_cell;
  const std::uint32_t* across_within;
  const std::uint32_t* first_cell;
  const float* first_column;
  const std::uint32_t* first_weight;  ///< of its row of the table
  const std::uint32_t* key;
  const float* phase_turns;
  const float* power;  ///< the sum's variance
  // Of each group:
  const std::uint32_t* cells;
  std::size_t bins;
  std::uint32_t common_key;  ///< added to each bin's
  // The table:
  const float* weights;  ///< real and imaginary part
  float columns_per_cell;
  std::uint32_t last_column;  ///< weighs nothing, like all beyond
  // Out, a value a bin:
  float* re;
  float* im;
};

/// Sums of the scatterers' complex normal strengths times weight and phase, scaled to their
/// variance.
void sum_cells(const CellSums& sums);

/// Complex normal numbers of variance 1: the same for the same key and place in the array.
void draw_complex_normal(std::uint32_t key, std::size_t count, float* re, float* im);

/// A pulse's taps over fields of independent bins: out[n] = sum over |d| <= reach of taps[|d|] *
/// in[n + d]; what is read has `reach` bins more on either side, and points to the first of all.
struct Shaping {
  const float* taps;
  const float* energy_taps;  ///< their squares
  std::size_t reach;
  std::size_t bins;
  const float* spread_re;
  const float* spread_im;
  const float* power;  ///< the fields' variance, which the shaped ones are scaled back to
  float* re;
  float* im;
};
void shape(const Shaping& shaping);

/// What a detector sees of one look, and what it has seen so far.
struct Detection {
  std::size_t bins;
  // The echo, of the other side as well or null, which leaks by so much.
  const float* re;
  const float* im;
  const float* other_re;
  const float* other_im;
  float leak;
  // White noise, as Shaping::spread_re, to be shaped; null: its power is added to the energy
  // instead.
  const float* white_re;
  const float* white_im;
  const float* taps;
  std::size_t reach;
  const float* power;
  // The gain to full scale, and white noise behind it of that rms; null: its power, likewise.
  const float* gain;
  float step;
  const float* behind_re;
  const float* behind_im;
  float behind_rms;
  // Looks.
  bool first, peak;
  float share;
  // Out, and added to (or outdone) if not the first:
  float* energy;
  float* detected;  ///< amplitude over full scale
};
void detect(const Detection& detection);

/// A recorder's end.
struct Digitisation {
  std::size_t bins;  ///< any number of them
  const float* amplitude;
  float gain;             ///< to full scale, where it clips
  bool square_root;       ///< at most one of
  double curve_range_db;  ///< these, a logarithmic curve's if above 0
  double full_scale;
  std::uint32_t* samples;
};
void digitise(const Digitisation& digitisation);

}  // namespace ensonify::engine
