#pragma once

#include <functional>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/base/work_control.h>
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
  /// Heights at least this far apart are taken as independent: the field may repeat at this
  /// distance from the heightfield. 0: there is no such distance.
  double reach_m = 0.0;
  /// Waves of any length stay regular over this distance, because the spectrum has narrow peaks; 0:
  /// over some of their own lengths only.
  double regular_m = 0.0;
  /// If set, the field is scaled so that the integral of weight * amplitude^2 over the field's
  /// wavenumbers is calibrated_m2; with a weight of 1 this is the variance.
  OverWavenumber weight;
  double calibrated_m2 = 0.0;
};

/// Adds a part of such a field, minus the mean of that part. The long waves of a field whose period
/// is much longer than the heightfield are made on coarser lattices (wave_bands.h). Throws
/// std::invalid_argument if a period has more than 2^29 cells, std::bad_alloc if it does not fit in
/// memory. The stop check is called for each row of a transform, but not during a transform.
void add_spectral_field(Heightfield& field, const SpectralField& what, const RandomStream& noise,
                        const WorkControl& control = {});

/// The field without a weight, its amplitude multiplied by the factor that the weight asks for. The
/// integral is a sum over the longest waves, then over wider and wider steps of wavenumber.
SpectralField calibrated(SpectralField what, const Heightfield& field);

// The functions below use only the size of the heightfield and the lengths of the field.

/// Whether a period has at most 2^29 cells.
bool fits_one_transform(const Heightfield& field, const SpectralField& what);

/// The bytes that add_spectral_field() allocates at the same time.
double spectral_field_bytes(const Heightfield& field, const SpectralField& what);

}  // namespace ensonify::engine
