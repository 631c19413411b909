#pragma once

#include <optional>

#include <ensonify/scatter/backscatter.h>
#include <ensonify/scatter/sediment.h>

namespace ensonify::engine {

/// How a wall of a material reflects: shares of the energy that arrives.
struct WallMirror {
  double smooth = 0.0;  ///< as a smooth surface would
  double rough = 0.0;   ///< from facets that are inclined to the surface
  double slope = 0.0;   ///< rms of that inclination in one direction, as a tangent
};

/// What one sonar hears of a material of the seafloor.
struct MaterialInSonar {
  scatter::BackscatterTable table;
  double smooth_specular = 0.0;  ///< scatter::Solid::smooth_specular(), 0 where it is not a solid
  std::optional<scatter::Sediment> sediment = {};  ///< none where it is not a sediment
  std::optional<WallMirror> wall = {};             ///< none: walls are not looked for
};

}  // namespace ensonify::engine
