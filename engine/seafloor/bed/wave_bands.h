#pragma once

#include <cstdint>
#include <span>

namespace ensonify::engine {

/// The waves of a field, divided into bands. Each is made on a lattice, whose points lie
/// `band_ratio` times as far apart as those of the band before, and is interpolated to that one's
/// lattice. Neighbouring bands overlap with shares whose squares add up to 1, so that the sum of
/// independent bands has the spectrum of the field.
constexpr int band_ratio = 4;

/// The share of a wave's amplitude that is made on a lattice, by the number of its points per wave:
/// 1 for short waves, 0 for long ones.
double kept_share(double points_per_wave);
/// The share that is left to the next, coarser lattice.
double handed_over_share(double points_per_wave);

/// Rises from 0 at t = 0 to 1 at t = 1, with three continuous derivatives; constant outside.
double smooth_step(double t);

/// A part of an endless lattice. Point 0 of the coarser lattice lies on point 0.
struct LatticeWindow {
  std::int64_t column, row;  // of the first point
  int columns, rows;

  /// The part of the coarser lattice from which this one is interpolated.
  LatticeWindow coarser() const;
};

/// Adds to `heights`, those of a window row by row, the heights of `window.coarser()`,
/// interpolated. Waves of 4 coarse points and more keep their amplitude.
void add_interpolated(std::span<const double> coarser, const LatticeWindow& window,
                      std::span<double> heights);

}  // namespace ensonify::engine
