#pragma once

#include <functional>

#include <ensonify/engine/random.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// A stationary Gaussian field by its spectrum over wavenumber (kx east, ky north, rad/m).
struct SpectralField {
  using OverWavenumber = std::function<double(double kx, double ky)>;

  /// Square root of the power spectrum, so that the variance is the integral of its square over
  /// (kx, ky); even, and not asked for at k = 0, where the field has nothing.
  OverWavenumber amplitude;
  double period_m =
      0.0;  ///< the field repeats after this, or twice the heightfield if that is more
  /// Where set, the field is scaled so that the integral of weight times amplitude^2 over the
  /// wavenumbers it is made of is calibrated_m2; with a weight of 1 that is its variance.
  OverWavenumber weight;
  double calibrated_m2 = 0.0;
};

/// Adds a cut-out of such a field, less the cut-out's mean. Throws std::invalid_argument if the
/// field has more than 2^29 cells, std::bad_alloc if memory does not hold it.
void add_spectral_field(Heightfield& field, const SpectralField& what, const RandomStream& noise);

/// The period of a fractal field over a heightfield: that of a square, since a strip would have too
/// few long waves across and too much power along.
double fractal_period_m(const Heightfield& field, double hurst);

/// The bytes that add_spectral_field() allocates; of the heightfield only the size counts.
double spectral_field_bytes(const Heightfield& field, double period_m);

}  // namespace ensonify::engine
