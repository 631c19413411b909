#pragma once

#include <optional>

namespace ensonify::engine {

/// Sea state: wind, shipping noise and volume scattering.
struct SeaState {
  double wind_mps = 5.0;
  double shipping = 0.5;                ///< 0: no ships near .. 1: heavy traffic
  double volume_scattering_db = -80.0;  ///< S_v, dB re 1/m
  /// Number of scatterers (bubbles, plankton, grains) per m^3 that have this strength together. A
  /// cell near the sonar has few of them, so its echo is often much stronger or weaker than the
  /// mean. 0: very many.
  double volume_scatterers_per_m3 = 0.0;
};

/// What is received in addition to the direct echo; nothing by default.
struct OtherPathsOptions {
  bool surface = false;             ///< first return and reverberation of the sea surface
  bool volume = false;              ///< reverberation of the water
  bool multiples = false;           ///< echoes reflected by the sea surface
  bool second_time_around = false;  ///< echoes of earlier pings, from beyond the range
  /// Loss of a reflection at the bed, in multiples. Unset: the loss of the bed's sediment at the
  /// grazing angle, or 10 dB if the bed is not a sediment.
  std::optional<double> bottom_loss_db;
  bool double_bounce = false;  ///< echoes by way of a wall and the bed in front of it
  /// Loss of the reflection at a wall, dB; the wall is then taken as smooth. Unset: the wall's
  /// material decides.
  std::optional<double> wall_loss_db;
  double burst_m = 0.0;  ///< range over which transmit leakage blinds the receiver; 0: none
  /// Level at which one side's signal is received in the other side, relative to that signal;
  /// unset: none.
  std::optional<double> crosstalk_db;
};

}  // namespace ensonify::engine
