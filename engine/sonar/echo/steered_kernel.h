#pragma once

#include <cstddef>
#include <cstdint>

namespace ensonify::engine {

// Kernels over the bins of one plane and one steered beam. They are compiled once for each kind of
// vector register; all variants do the same operations on each number, without fused operations, so
// their results have the same bits. Arrays have one value per bin.

/// What a plane sees.
struct PlaneBins {
  const float* energy;
  const float* lit;
  const float* shadowed;
  const std::uint32_t* label;  ///< FanPlanes::label
};
/// The sums of a beam over the planes, and which plane adds most.
struct BeamBins {
  float *energy, *lit, *shadowed;
  float* of_label;  ///< the energy that has the label of the strongest plane
  float *most, *most_shadowed;
  std::uint32_t *label, *plane, *shadowing_plane;
};
/// Adds a plane, times the power that the beam receives from it.
void add_plane(const PlaneBins& plane, std::uint32_t number, float power, std::size_t bins,
               const BeamBins& beam);
/// Adds the plane's energy to `of_label` in bins where its label is the strongest plane's.
void add_same_label(const PlaneBins& plane, float power, std::size_t bins, const BeamBins& beam);

/// Adds a plane's complex field, times the field (re, im) that the beam receives from it.
struct FieldSums {
  const float *plane_re, *plane_im;
  float re, im;
  float *sum_re, *sum_im;
};
void add_field(const FieldSums& sums, std::size_t bins);

}  // namespace ensonify::engine
