#pragma once

#include <span>
#include <vector>

#include <ensonify/engine/base/units.h>
#include <ensonify/engine/seafloor/layers/relief_kind.h>

namespace ensonify::engine {

/// Trains of crests that do not fade: ripples, megaripples, sand waves. The height is a fixed
/// profile of a random phase (after Tang, Henyey, Hefner and Traykovski 2009). So crests bend, end,
/// fork and change their spacing, but keep their height. Wave ripples are about 0.15 wavelengths
/// high (Wiberg and Harris 1994). Megaripples are 0.6 to 10 m long and 0.1 to 0.5 m high, sand
/// waves are 50 to 500 m long and 1 to 10 m high.
struct Bedforms {
  double wavelength_m = 1.0;
  double height_m = 0.1;           ///< trough to crest, median; 0: none
  double across_crests_rad = 0.0;  ///< heading across the crests, which the steep sides face
  double sharpness = 0.6;          ///< 0: a cosine, 1: crests are edges between round troughs
  double asymmetry = 0.0;          ///< 0: both sides equal; towards 1: steep lee sides
  double bend_rad = 8.0 * degree;  ///< rms turn of the crests, and relative change of wavelength
  double drift_m = 0.0;  ///< distance over which bend and height change; 0: 12 wavelengths
  /// Rms change of the height's logarithm over drift_m. A crest that becomes higher than height_m
  /// becomes no steeper than the angle of repose of sand (33 degrees).
  double height_spread = 0.35;
  /// Rms shift of the crests' lines over about two wavelengths, as a share of the wavelength. The
  /// logarithm of the height changes by four times this value.
  double raggedness = 0.1;
  double forks = 3.0;  ///< pairs of fork and end in a square of 10 x 10 wavelengths
};

/// Adds bedforms, with a mean of zero over a wavelength, at the points whose weight is not 0, or
/// everywhere if there are no weights. Throws std::invalid_argument for values outside their ranges
/// and for cells longer than a quarter of the wavelength.
void add_bedforms(Heightfield& field, const Bedforms& relief, const LayerDraws& draws,
                  std::span<const double> weight = {});

const ReliefKind<Bedforms>& kind_of(const Bedforms&);

/// The profile of a crest as a function of the phase, between -1 and 1; one turn is from trough to
/// trough. Interpolated in a table: the error is 1e-3 at the sharpest crest's edge, 1e-5 elsewhere.
class CrestProfile {
 public:
  /// Sharpness from 0 to 1 and asymmetry from 0 to below 1, as in Bedforms.
  CrestProfile(double sharpness, double asymmetry);
  double at(double turns) const;  ///< any finite phase
  double steepest() const;        ///< greatest change of the profile per turn

 private:
  static constexpr int steps = 2048;  // from crest to trough
  double rise_;                       // the gentle side's share of a turn
  std::vector<double> at_step_;
};

}  // namespace ensonify::engine
