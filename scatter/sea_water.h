#pragma once

namespace ensonify::scatter {

/// What the sea's sound speed and absorption depend on, beside depth and frequency.
struct SeaWater {
  double temperature_c = 10.0;
  double salinity_psu = 35.0;
  double ph = 8.1;
};

/// Sound speed after Mackenzie, JASA 70, 807 (1981), eq. 1; for -2..30 degrees Celsius, 25..40 psu
/// and 0..8000 m.
double sound_speed_mps(const SeaWater& water, double depth_m);

/// Absorption of a plane wave after Francois and Garrison, JASA 72, 1879 (1982): boric acid,
/// magnesium sulphate and pure water.
double absorption_db_per_m(const SeaWater& water, double depth_m, double frequency_hz);

}  // namespace ensonify::scatter
