#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ensonify::scatter {

/// A seabed by APL-UW TR 9407 (1994), section IV.A: six numbers, relative to the water above it.
///
/// The handbook's wavenumbers are in rad/cm, and so are the arguments `k_per_cm` of all functions
/// in this folder. The bed's relief has the isotropic spectrum W2(K) = strength K^-exponent cm^4
/// (eq. 7), whose integral over the plane is the variance of height.
struct Sediment {
  double density_ratio = 0.0;       ///< rho, 1 to 3
  double sound_speed_ratio = 0.0;   ///< nu, 0.8 to 3
  double loss = 0.0;                ///< delta, Im/Re of the sediment's wavenumber, 0 to 0.1
  double volume = 0.0;              ///< sigma2, volume cross-section divided by attenuation, 0 to 1
  double exponent = 3.25;           ///< gamma, between 2 and 4 (recommended: 2.4 to 3.9); eq. 8
  double strength_cm4 = 0.0;        ///< w2, 0 to 1; below 1e-12 the bed counts as smooth
  double strength_offset_db = 0.0;  ///< is added to the scattering strength of each model
  /// 10 log10 mu of Lambert's law, for rock whose measured strength follows this law. If it is
  /// given, the model `tr9407` uses it in place of the six numbers, with a lobe near vertical.
  std::optional<double> lambert_mu_db;

  double alpha() const { return exponent / 2.0 - 1.0; }
  bool smooth() const { return strength_cm4 < 1e-12; }
};

/// Throws std::invalid_argument, with the range, for values outside the ranges of TR 9407 IV.A.8.
void check(const Sediment& sediment);

struct NamedSediment {
  std::string_view name;
  std::optional<double> mean_grain_size_phi;  ///< none for rock and stones
  Sediment sediment;
};

/// The sediments of TR 9407 table 2, coarse to fine, one row per name. If a name has a mean grain
/// size, the parameters are computed by the regressions (sediment_of_grain_size()), because the
/// table's numbers are rounded.
///
/// The strength of `rock` and `rough rock` is measured. Olson, Lyons and Saebo, JASA 139, 1833
/// (2016), abstract, found -33 to -26 dB at 20 degrees and 100 kHz on smooth outcrops. On very
/// rough outcrops they found -30 to -20 dB, by Lambert's law. `rock` and `rough rock` follow
/// Lambert's law through the middle of these ranges, and have the lobe of stone near vertical.
/// `handbook rock` and `handbook rough rock` have the handbook's strength: -12 and -6 dB at 20
/// degrees, which is more than an opaque surface returns (energy_bound.h).
std::vector<NamedSediment> named_sediments();

/// The sediment with this name. Case is ignored, and space, hyphen and underscore count as equal.
/// For an unknown name throws std::invalid_argument with the nearest names.
Sediment sediment_named(std::string_view name);

/// By regressions over mean grain size, TR 9407 eqs 2-10. Throws std::invalid_argument outside
/// -1..9 phi.
Sediment sediment_of_grain_size(double mean_grain_size_phi);

/// Whether sound in the bed is at least as fast as in a bed of 2 mm grains (-1 phi), Wentworth's
/// border between sand and gravel. The sound speed decides, because each bed has one, with or
/// without a name. It alone separates rock and stones from beds that the regressions describe.
bool gravel_or_rock(const Sediment& sediment);

/// Wavenumber in the water, rad/cm. Throws std::invalid_argument unless both arguments are above 0
/// and finite.
double wavenumber_per_cm(double frequency_hz, double sound_speed_mps);

/// The wavenumber, rad/cm, at which TR 9407's terms of the relief are evaluated. It is the
/// wavenumber in the water; for gravel and rock above 100 kHz it is the wavenumber of 100 kHz.
/// Without this limit, the large-roughness form would differ from measurements by 10 to 20 dB
/// (Jackson's elastic small-slope results at 300 kHz).
double relief_wavenumber_per_cm(const Sediment& sediment, double frequency_hz,
                                double sound_speed_mps);

/// By how many decibels the mean levels of a model may be too high or too low. 0 from 10 to 100
/// kHz. From 100 kHz to 1 MHz it is the largest difference between `tr9407` and the small-slope
/// approximation at 3 to 90 degrees. It depends on the bed's sound speed: 2 for silt, clay and very
/// fine sand, 6 up to medium sand, 10 up to sandy gravel, 15 for stones, 26 for the handbook's
/// rock. For measured rock and the model `tr9407`, which alone has the measured strength, it is 10:
/// all outcrops that Olson and others measured at 100 kHz are within 10 dB. Other models have the
/// same spreads as `tr9407`, without this exception. At other frequencies the spread is infinite,
/// because there is nothing to compare with.
double expected_spread_db(const Sediment& sediment, double frequency_hz,
                          std::string_view model = "tr9407");

/// The spread of an ordinary bed, in decibels. Levels with a spread up to this one need no warning:
/// the handbook itself states 5 to 10 dB for a bed of which only the name is known.
constexpr double ordinary_spread_db = 6.0;

/// Words for a warning: "expected within 6 dB", or, if the spread is infinite, that it is not
/// known.
std::string spread_text(double spread_db);

/// A warning, to be given once per run, if the frequency is outside the range for which TR 9407 is
/// validated (10 to 100 kHz), or the exponent is outside the recommended range; otherwise none.
std::optional<std::string> validity_warning(const Sediment& sediment, double frequency_hz,
                                            std::string_view model = "tr9407");

/// The spectrum of the relief, W2(K), in cm^4: TR 9407 eq. 7.
double relief_spectrum_cm4(const Sediment& sediment, double k_per_cm);

}  // namespace ensonify::scatter
