#pragma once

#include <cstddef>
#include <cstdint>

namespace ensonify::engine {

// Kernels that sum the planes of a fan to steered beams, for a block of bins. They are compiled
// once for each kind of vector register; all variants do the same operations on each number, in the
// same order and without fused operations, so their results have the same bits.

/// The number of bins of a block. Tables over bins have room for whole blocks.
inline constexpr std::size_t steered_block = 16;
constexpr std::size_t whole_blocks(std::size_t bins) {
  return (bins + steered_block - 1) / steered_block * steered_block;
}

/// What a beam receives from a direction: a table of complex fields over the distance of the
/// direction's sine from that of the beam, interpolated linearly. A bin may have its own table.
struct BeamFields {
  const float* values;        ///< real and imaginary part of each
  const std::int32_t* first;  ///< by bin: the number of the value at distance 0
  const float* columns;       ///< by bin: from this distance on, in columns, the field counts as 0
  bool is_real;               ///< whether all imaginary parts are 0
  float axis, columns_per_sine;
};

/// The planes [first, last) of a fan, in a block that begins at `bin`. A plane's row of a table is
/// `stride` values long.
struct PlaneBlock {
  std::size_t first, last, stride, bin;
  const float* sine;  ///< of the direction of what the plane sees in a bin
};

/// What planes see, plane by plane.
struct PlaneBins {
  const float *energy, *labelled, *lit, *shadowed;
  const std::uint32_t* label;  ///< these are as in FanPlanes
};
/// What one beam receives in each bin.
struct BeamBins {
  float *energy, *lit, *shadowed;
  float* of_label;                         ///< the energy that has the label of the strongest plane
  float* most;                             ///< the energy of the strongest plane
  std::uint32_t *plane, *shadowing_plane;  ///< the strongest plane, and that of the most shadow
};
/// Sums the planes, each times the power that the beam receives from it. `powers` has room for
/// steered_block values for each plane.
void receive_planes(const PlaneBlock& block, const PlaneBins& planes, const BeamFields& fields,
                    float* powers, const BeamBins& beam);

/// Sums complex fields of planes, each times the field that the beam receives from it.
struct FieldSums {
  const float *plane_re, *plane_im;  ///< plane by plane
  float *sum_re, *sum_im;            ///< of the beam, by bin
};
void receive_fields(const PlaneBlock& block, const BeamFields& fields, const FieldSums& sums);

}  // namespace ensonify::engine
