#pragma once

#include <functional>

#include <ensonify/engine/random.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// A stationary Gaussian field, given by its spectrum over wavenumber (kx east, ky north, rad/m).
struct SpectralField {
  using OverWavenumber = std::function<double(double kx, double ky)>;

  /// Square root of the power spectrum: the variance is the integral of its square over (kx, ky).
  /// An even function; it is not called at k = 0, where the field has no power.
  OverWavenumber amplitude;
  /// The field repeats after this length, or after twice the heightfield if that is longer.
  double period_m = 0.0;
  /// If set, the field is scaled until the integral of weight * amplitude^2 over the field's
  /// wavenumbers is calibrated_m2; with a weight of 1 this is the variance.
  OverWavenumber weight;
  double calibrated_m2 = 0.0;
};

/// Adds a part of such a field, minus the mean of that part. Throws std::invalid_argument if the
/// field has more than 2^29 cells, std::bad_alloc if it does not fit in memory.
void add_spectral_field(Heightfield& field, const SpectralField& what, const RandomStream& noise);

/// Whether the field has at most 2^29 cells; only the size of the heightfield is used.
bool fits_one_transform(const Heightfield& field, double period_m);

/// The period of a fractal field over a heightfield, the same in both directions: a long strip
/// would have too few long waves across it and too much power along it.
double fractal_period_m(const Heightfield& field, double hurst);

/// The bytes that add_spectral_field() allocates; only the size of the heightfield is used.
double spectral_field_bytes(const Heightfield& field, double period_m);

}  // namespace ensonify::engine
