#pragma once

#include <ensonify/scatter/sea_water.h>
#include <ensonify/scatter/sound_speed_profile.h>

namespace ensonify::engine {

/// The water between sonar and bed.
struct Medium {
  double sound_speed_mps = scatter::nominal_sound_speed_mps;
  double absorption_db_per_m = 0.0;
  /// Absorption over depth; null: absorption_db_per_m at all depths. It must outlive everything
  /// that is made with this medium.
  const scatter::SoundSpeedProfile* profile = nullptr;
};

}  // namespace ensonify::engine
