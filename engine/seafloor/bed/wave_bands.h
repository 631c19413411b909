#pragma once

#include <cstdint>
#include <span>

namespace ensonify::engine {

/// The waves of a field are divided into bands. Each band is made on a lattice whose spacing is
/// `band_ratio` times the spacing of the band before, and is interpolated to the lattice of the
/// band before. Neighbouring bands overlap with shares whose squares add up to 1, so that the sum
/// of independent bands has the spectrum of the field.
constexpr int band_ratio = 4;

/// The share of a wave's amplitude that is made on a lattice, as a function of the lattice's points
/// per wave: 1 for short waves, 0 for long waves.
double kept_share(double points_per_wave);
/// The share that is made on the next, coarser lattice.
double handed_over_share(double points_per_wave);

/// Rises from 0 at t = 0 to 1 at t = 1, with three continuous derivatives; constant outside.
double smooth_step(double t);

/// A part of an infinite lattice. Point 0 of the coarser lattice lies on point 0 of this lattice.
struct LatticeWindow {
  std::int64_t column, row;  // of the first point
  int columns, rows;

  /// The part of the coarser lattice from which this part is interpolated.
  LatticeWindow coarser() const;
};

/// Interpolates the heights `coarser` of `window.coarser()` and adds them to `heights`, the heights
/// of `window`, all row by row. Waves of at least 4 coarse points keep their amplitude.
void add_interpolated(std::span<const double> coarser, const LatticeWindow& window,
                      std::span<double> heights);

}  // namespace ensonify::engine
