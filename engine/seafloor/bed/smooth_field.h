#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// A smooth, isotropic and nearly Gaussian field of zero mean and unit variance: a sum of plane
/// waves with lengths from the shortest to the longest. Longer waves have larger amplitudes. The
/// value depends only on the place, not on a grid. Layers use such fields to vary direction,
/// position and borders.
class SmoothField {
 public:
  /// Throws std::invalid_argument unless 0 < shortest <= longest.
  SmoothField(const RandomStream& draws, double shortest_m, double longest_m);

  double at(double x_m, double y_m) const;
  /// The values at a grid's points, interpolated if the grid is much finer than the waves.
  std::vector<double> over(const Heightfield& grid, int threads = 1) const;
  /// The rms slope of the field in any one direction, per metre.
  double slope_per_m() const { return slope_per_m_; }

 private:
  struct Wave {
    double kx, ky, phase, amplitude;
  };
  std::vector<double> over_band(const Heightfield& band) const;
  /// The values at the places (x, y), row by row.
  void take_values(std::span<const double> x_m, std::span<const double> y_m,
                   std::span<double> values) const;

  double shortest_m_;
  double slope_per_m_ = 0.0;
  std::vector<Wave> waves_;
};

}  // namespace ensonify::engine
