#pragma once

#include <cstddef>
#include <cstdint>

namespace ensonify::engine {

/// The number of bins in a group. Arrays that kernels write, or read with one value per bin, must
/// have room for whole groups.
inline constexpr std::size_t signal_group = 16;
constexpr std::size_t whole_groups(std::size_t bins) {
  return (bins + signal_group - 1) / signal_group * signal_group;
}

// The arguments of the kernels are plain arrays: kernels are compiled once for each kind of vector
// register and must not share inline functions with the rest of the program. All variants do the
// same operations on each number, without fused multiply-adds, so their results have the same bits.

/// Computes the cells of the scatterers of each bin.
struct CellPlaces {
  std::size_t bins;
  // One value per bin:
  const float* intensity;  ///< 0: the bin has no cells
  const float* x_m;
  const float* y_m;
  const float* z_m;
  const float* range_m;
  const float* cells_per_m;  ///< along the array
  const float* reach;        ///< cells on either side
  // The frame: weights of a place's coordinates and a constant. They give where the line through
  // the place, parallel to the array, crosses the beam's middle.
  double across[3], across_add;
  double along[3], along_add;
  double origin_across;  ///< of the array
  double skew;           ///< how far that line moves across the cells per length along them
  double across_cells_per_m, turns, rise, columns_per_cell;
  // Out, one value per bin: The first cell along the line: its number across, the line's place
  // within the cell (in 2^-32 of the cell's length), and the cell's number along.
  std::uint32_t* across_cell;
  std::uint32_t* across_within;
  std::uint32_t* first_cell;
  float* first_column;  ///< where this cell begins, in columns of the table from the beam's middle
  float* phase_turns;   ///< turns of phase over one cell across
  // Out, one value per group:
  std::uint32_t* cells;      ///< largest number of cells along the array
  std::uint32_t* placeless;  ///< not 0: a bin of the group has energy but no place (the origin)
};
void place_cells(const CellPlaces& places);

/// Places on the ground count in units of 2^-patch_bits of a patch (CellSums::Texture).
inline constexpr int patch_bits = 12;

struct CellSums {
  // One value per bin:
  const std::uint32_t* across_cell;
  const std::uint32_t* across_within;
  const std::uint32_t* first_cell;
  const float* first_column;
  const std::uint32_t* first_weight;  ///< index of the bin's row in the table
  const std::uint32_t* key;
  const float* phase_turns;
  const float* cells_per_m;
  const float* power;  ///< variance of the sum
  // One value per group:
  const std::uint32_t* cells;
  std::size_t bins;
  float across_per_m;        ///< cells across that the line crosses per metre along
  std::uint32_t common_key;  ///< added to each bin's key
  // The patches under the scatterers (TexturedGround); x null: all scatter alike. One value per
  // bin: the place of the first scatterer, and the step to the next; the rows of quantiles, and the
  // share of the second row.
  struct Texture {
    const std::uint32_t *x, *y, *step_x, *step_y, *row, *glint_row;
    const float* glint_share;
    const float* quantiles;
    std::uint32_t key;
    /// The strengths of the patches in the order in which they are summed. All looks have the same
    /// strengths: the first look writes them, the others read them.
    float* strengths;
    bool known;
  } texture;
  // The table:
  const float* weights;  ///< real and imaginary part of each column
  float columns_per_cell;
  std::uint32_t last_column;  ///< the weight is 0 there and beyond
  // Out, one value per bin:
  float* re;
  float* im;
};

/// Sums of the scatterers' complex normal strengths times weight and phase, scaled to the variance.
void sum_cells(const CellSums& sums);

/// Complex normal numbers of variance 1; a number depends only on the key and its index.
void draw_complex_normal(std::uint32_t key, std::size_t count, float* re, float* im);

/// The weights of a pulse's filter (SpeckleFilter): out[n] = sum over d = 0 .. reach of
/// taps[d] * in[n - d] and, if it is even, sum over d = 1 .. reach of taps[d] * in[n + d]. Inputs
/// have `reach` additional bins on either side; their pointers point to the first of these.
struct FilterTaps {
  const float* taps;
  std::size_t reach;
  bool even;
};

/// Filters fields of independent bins.
struct Shaping {
  FilterTaps filter;
  const float* energy_taps;  ///< the squares of the filter's taps
  std::size_t bins;
  const float* spread_re;
  const float* spread_im;
  const float* power;   ///< variance of the input fields, padded like them
  const float* wanted;  ///< variance that the outputs are scaled to
  float* re;
  float* im;
};
void shape(const Shaping& shaping);

/// One look of the detector, and its result over the looks so far.
struct Detection {
  std::size_t bins;
  // The echo; and the echo of the other side (or null), which leaks into it with the factor `leak`.
  const float* re;
  const float* im;
  const float* other_re;
  const float* other_im;
  float leak;
  // White noise, padded like Shaping::spread_re, which is filtered; null: its power is added to
  // the energy instead.
  const float* white_re;
  const float* white_im;
  FilterTaps filter;
  const float* power;
  // The gain to full scale, and white noise of rms behind_rms after it; null: its power is added.
  const float* gain;
  float step;
  const float* behind_re;
  const float* behind_im;
  float behind_rms;
  // Whether it is the first look, whether the detector keeps the peak, and 1 / number of looks.
  bool first, peak;
  float share;
  // Out; after the first look, values are added to (or compared with) the values of earlier looks:
  float* energy;
  float* detected;  ///< amplitude over full scale
};
void detect(const Detection& detection);

/// The last stage of a recorder.
struct Digitisation {
  std::size_t bins;  ///< any number, not only whole groups
  const float* amplitude;
  float gain;             ///< to full scale, where it clips
  bool square_root;       ///< whether the curve is a square root
  double curve_range_db;  ///< range of a logarithmic curve; 0: another curve
  double full_scale;
  std::uint32_t* samples;
};
void digitise(const Digitisation& digitisation);

}  // namespace ensonify::engine
