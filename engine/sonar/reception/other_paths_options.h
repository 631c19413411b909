#pragma once

#include <optional>

namespace ensonify::engine {

/// Sea state: wind, shipping noise, volume scattering.
struct SeaState {
  double wind_mps = 5.0;
  double shipping = 0.5;                ///< 0 none near .. 1 heavy traffic
  double volume_scattering_db = -80.0;  ///< S_v, dB re 1/m
};

/// Which sound is received in addition to the direct echo; none by default.
struct OtherPathsOptions {
  bool surface = false;                  ///< the sea surface's return and its reverberation
  bool volume = false;                   ///< the water's
  bool multiples = false;                ///< echoes by way of the surface
  std::optional<double> bottom_loss_db;  ///< of a reflection at the bed, in multiples; unset: the
                                         ///< sediment's at that angle, 10 dB where it has none
  bool double_bounce = false;            ///< between a wall and the bed before it
  double wall_loss_db = 5.0;             ///< of the reflection at the wall
  double burst_m = 0.0;  ///< range over which the transmitted pulse blinds the receiver; 0: none
  std::optional<double> crosstalk_db;  ///< of one side in the other; unset: none
};

}  // namespace ensonify::engine
