#pragma once

#include <limits>

namespace ensonify::scatter {

/// A typical sound speed, for use where none is known.
inline constexpr double nominal_sound_speed_mps = 1500.0;

/// The properties of sea water that sound speed and absorption depend on, in addition to depth and
/// frequency. Every function below throws std::invalid_argument for values that no sea has:
/// temperatures outside -4..50 degrees Celsius (ITS-90), salinities outside 0..50 psu, pH outside
/// 6..9, depths outside 0..12000 m.
struct SeaWater {
  double temperature_c = 10.0;
  double salinity_psu = 35.0;
  double ph = 8.1;
};

/// A closed interval.
struct Interval {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool holds(double value) const { return value >= low && value <= high; }
};

/// The range of water that a formula was fitted to. Outside it the formula is an extrapolation.
struct FittedWater {
  Interval temperature_c, salinity_psu, depth_m;
  Interval ph, frequency_hz;  ///< only for formulas of absorption
};

inline constexpr FittedWater mackenzie_fit = {{-2, 30}, {25, 40}, {0, 8000}, {}, {}};
inline constexpr FittedWater chen_millero_fit = {
    {0, 40}, {0, 40}, {0, 9726}, {}, {}};  // 10000 dbar
inline constexpr FittedWater leroy_fit = {{-2, 34}, {0, 42}, {0, 12000}, {}, {}};
inline constexpr FittedWater francois_garrison_fit = {
    {-2, 30}, {30, 35}, {0, 5000}, {}, {200, 1e6}};
inline constexpr FittedWater ainslie_mccolm_fit = {
    {-6, 35}, {5, 50}, {0, 7000}, {7.7, 8.3}, {100, 1e6}};

/// Sound speed after Mackenzie, JASA 70, 807 (1981), eq. 1.
double sound_speed_mps(const SeaWater& water, double depth_m);

/// The temperature of water with this sound speed, by the formula of sound_speed_mps(). If no
/// temperature of mackenzie_fit has this speed, the nearer end of that range.
double temperature_of_sound_speed_c(double sound_speed_mps, double salinity_psu, double depth_m);

/// Sound speed after Chen and Millero, JASA 62, 1129 (1977), as in UNESCO technical papers in
/// marine science 44 (1983), eqs. 33 to 37. The pressure is in excess of the atmosphere's, 0..12500
/// dbar.
double chen_millero_sound_speed_mps(const SeaWater& water, double pressure_dbar);

/// Sound speed after Leroy, Robinson and Goldsmith, JASA 124, 2774 (2008), eq. 2, for either
/// hemisphere.
double leroy_sound_speed_mps(const SeaWater& water, double depth_m, double latitude_rad);

/// Absorption of a plane wave after Francois and Garrison, JASA 72, 1879 (1982): boric acid,
/// magnesium sulphate and pure water. Also throws for a frequency that is not above zero.
double absorption_db_per_m(const SeaWater& water, double depth_m, double frequency_hz);

/// Absorption of a plane wave after Ainslie and McColm, JASA 103, 1671 (1998), eqs. 1 to 3. The
/// formulas are simpler, and are within 10 % of Francois and Garrison.
double ainslie_mccolm_absorption_db_per_m(const SeaWater& water, double depth_m,
                                          double frequency_hz);

/// The depth at which the standard ocean (35 psu, 0 degrees Celsius) has a pressure; the pressure
/// is the one in excess of the atmosphere's. Saunders and Fofonoff, Deep-Sea Res. 23, 109 (1976),
/// refitted in UNESCO 44, eq. 25. Gravity depends on the latitude. Throws std::invalid_argument for
/// pressures outside 0..12500 dbar and latitudes outside -pi/2..pi/2.
double depth_of_pressure_m(double pressure_dbar, double latitude_rad);

/// The pressure at a depth: the solution of the formula of depth_of_pressure_m(), up to rounding.
double pressure_at_depth_dbar(double depth_m, double latitude_rad);

}  // namespace ensonify::scatter
