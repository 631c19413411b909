#pragma once

#include <optional>

#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/sea_water.h>
#include <ensonify/scatter/sediment.h>
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

/// How a wall of a material reflects: shares of the energy that arrives.
struct WallMirror {
  double smooth = 0.0;  ///< reflected as by a smooth surface
  double rough = 0.0;   ///< reflected by facets that are inclined to the surface
  double slope = 0.0;   ///< rms of the facets' inclination in one direction, as a tangent
};

/// How a material of the seafloor scatters and reflects at the frequency of one sonar.
struct MaterialInSonar {
  scatter::BackscatterTable table;
  double smooth_specular = 0.0;  ///< scatter::Solid::smooth_specular(), 0 if it is not a solid
  std::optional<scatter::Sediment> sediment = {};  ///< none if it is not a sediment
  std::optional<WallMirror> wall = {};             ///< none: walls are not looked for
};

}  // namespace ensonify::engine
