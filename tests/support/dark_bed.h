#pragma once

#include <string>

namespace ensonify::tests {

/// The begin of a scene for the program: a level bed at a depth of 20 m that hardly scatters, and a
/// material for bright objects on it.
inline const std::string dark_bed = R"(version = 1
speckle = false
[sea]
sound_speed_mps = 1500
[seafloor]
extent_east_m = 80
extent_north_m = 80
cell_m = 1
depth_m = 20
material = "dark"
[seafloor.fractal]
height_at_1m_m = 0
[material.dark]
model = "lambert"
lambert_mu_db = -70
[material.bright]
model = "lambert"
lambert_mu_db = -5
)";

}  // namespace ensonify::tests
