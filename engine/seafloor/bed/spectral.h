#pragma once

#include <functional>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/base/work_control.h>
#include <ensonify/engine/seafloor/bed/heightfield.h>

namespace ensonify::engine {

/// A stationary Gaussian field, given by its spectrum over wavenumber (kx east, ky north, rad/m).
struct SpectralField {
  using OverWavenumber = std::function<double(double kx, double ky)>;

  /// The square root of the power spectrum: the integral of its square over (kx, ky) is the
  /// variance. It is an even function. It is not called at k = 0, where the field has no power.
  OverWavenumber amplitude;
  /// The field repeats after this length, or after twice the heightfield if that is longer.
  double period_m = 0.0;
  /// Heights at least this far apart are taken as independent, so the field may repeat at this
  /// distance from the heightfield. 0: there is no such distance.
  double reach_m = 0.0;
  /// Waves of any length stay regular over this distance, because the spectrum has narrow peaks. 0:
  /// waves are regular only over a few wavelengths.
  double regular_m = 0.0;
  /// If set, the field is scaled so that the integral of weight * amplitude^2 over the field's
  /// wavenumbers is calibrated_m2; with a weight of 1 this is the variance.
  OverWavenumber weight;
  double calibrated_m2 = 0.0;
};

/// Adds a part of the field `what`, minus the mean of this part, to a heightfield. If the period is
/// much longer than the heightfield, long waves are made on coarser lattices (wave_bands.h). Throws
/// std::invalid_argument if a period has more than 2^29 cells, std::bad_alloc if it does not fit in
/// memory. The stop check is called for each row of a transform, but not during a transform.
void add_spectral_field(Heightfield& field, const SpectralField& what, const RandomStream& noise,
                        const WorkControl& control = {});

/// The field without a weight: its amplitude is multiplied by the factor that follows from the
/// weight and calibrated_m2. The integral is a sum over each of the longest waves, and over
/// increasing steps of wavenumber for shorter waves.
SpectralField calibrated(SpectralField what, const Heightfield& field);

// The functions below use only the size of the heightfield and the lengths of the field.

/// Whether a period has at most 2^29 cells.
bool fits_one_transform(const Heightfield& field, const SpectralField& what);

/// The most bytes that add_spectral_field() has allocated at any time.
double spectral_field_bytes(const Heightfield& field, const SpectralField& what);

}  // namespace ensonify::engine
