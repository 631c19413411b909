#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ensonify::scatter {

/// A seabed as modelled by APL-UW TR 9407 (1994), section IV.A: six numbers, relative to the water
/// above.
///
/// The handbook's wavenumbers are in rad/cm, and so are those of all functions in this folder
/// (`k_per_cm`). Its relief has the isotropic spectrum W2(K) = strength K^-exponent cm^4 (eq. 7),
/// whose integral over the plane is the variance of height.
struct Sediment {
  double density_ratio = 0.0;       ///< rho, 1 to 3
  double sound_speed_ratio = 0.0;   ///< nu, 0.8 to 3
  double loss = 0.0;                ///< delta, Im/Re of the sediment's wavenumber, 0 to 0.1
  double volume = 0.0;              ///< sigma2, volume cross-section over attenuation, 0 to 1
  double exponent = 3.25;           ///< gamma, between 2 and 4 (recommended: 2.4 to 3.9); eq. 8
  double strength_cm4 = 0.0;        ///< w2, 0 to 1; below 1e-12 the bed counts as smooth
  double strength_offset_db = 0.0;  ///< added to the scattering strength that the models give
  /// 10 log10 mu of Lambert's law, for rock, whose strength is measured and follows that law. The
  /// model `tr9407` uses it in place of the six numbers, with a lobe near vertical.
  std::optional<double> lambert_mu_db;

  double alpha() const { return exponent / 2.0 - 1.0; }
  bool smooth() const { return strength_cm4 < 1e-12; }
};

/// Throws std::invalid_argument, with the valid range, for values outside TR 9407 IV.A.8's.
void check(const Sediment& sediment);

struct NamedSediment {
  std::string_view name;
  std::optional<double> mean_grain_size_phi;  ///< none for rock and stones
  Sediment sediment;
};

/// TR 9407 table 2, coarse to fine, one row per name. If a name has a mean grain size, the
/// parameters are those of the regressions, not the table's rounded numbers.
///
/// The strength of `rock` and `rough rock` is measured: Olson, Lyons and Saebo, JASA 139, 1833
/// (2016), abstract, found -33 to -26 dB at 20 degrees and 100 kHz on smooth outcrops, and -30 to
/// -20 dB, by Lambert's law, on very rough ones. Each has Lambert's law through the middle of its
/// range, and the lobe of stone near vertical. `handbook rock` and `handbook rough rock` have the
/// handbook's strength: -12 and -6 dB there, more than an opaque surface returns (energy_bound.h).
std::vector<NamedSediment> named_sediments();

/// The sediment of that name; case is ignored, and space, hyphen and underscore are the same.
/// Throws std::invalid_argument with the nearest names for an unknown one.
Sediment sediment_named(std::string_view name);

/// The regressions over mean grain size, TR 9407 eqs 2-10. Throws std::invalid_argument outside
/// -1 to 9 phi.
Sediment sediment_of_grain_size(double mean_grain_size_phi);

/// Whether the bed is at least as fast as one of 2 mm grains (-1 phi), Wentworth's border between
/// sand and gravel. The sound speed decides because each seabed has one, named or not, and it alone
/// distinguishes rock and stones from what the regressions over grain size describe.
bool gravel_or_rock(const Sediment& sediment);

/// Wavenumber in the water, rad/cm. Throws std::invalid_argument unless both are positive and
/// finite.
double wavenumber_per_cm(double frequency_hz, double sound_speed_mps);

/// The wavenumber at which the relief of TR 9407 is evaluated: the water's, but that of 100 kHz for
/// gravel and rock above it, because there the large-roughness form would differ from measurements
/// by 10 to 20 dB (Jackson's elastic small-slope results at 300 kHz).
double relief_wavenumber_per_cm(const Sediment& sediment, double frequency_hz,
                                double sound_speed_mps);

/// How far, either way, mean levels of the model `tr9407` may be off outside 10 to 100 kHz, in
/// decibels; 0 within. From 100 kHz to 1 MHz it is the largest difference from the small-slope
/// approximation at 3 to 90 degrees, by the bed's sound speed: 2 for silt, clay and very fine sand,
/// 6 to medium sand, 10 to sandy gravel, 15 for stones, 26 for the handbook's rock. For measured
/// rock it is 10, within which all outcrops lie that Olson and others measured at 100 kHz; only
/// `tr9407` has that strength. Another model is that far off too, by the same comparison. Infinite
/// elsewhere: there is nothing to compare with.
double expected_spread_db(const Sediment& sediment, double frequency_hz,
                          std::string_view model = "tr9407");

/// The spread of an ordinary bed. Levels with a spread up to this need no warning: the handbook
/// itself states 5 to 10 dB for a bed that is known by its name alone.
constexpr double ordinary_spread_db = 6.0;

/// "expected within 6 dB", or that nothing is known, for a warning.
std::string spread_text(double spread_db);

/// A warning, to be given once per run, if the frequency is outside TR 9407's validity (10 to 100
/// kHz) or the exponent outside its recommended range; otherwise none.
std::optional<std::string> validity_warning(const Sediment& sediment, double frequency_hz,
                                            std::string_view model = "tr9407");

/// W2(K), TR 9407 eq. 7, cm^4.
double relief_spectrum_cm4(const Sediment& sediment, double k_per_cm);

}  // namespace ensonify::scatter
