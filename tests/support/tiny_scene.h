#pragma once

#include <string>

namespace ensonify::tests {

/// A fast scene for the program: a small bed, few and short pings, no warnings.
inline const std::string tiny_scene = R"(version = 1
[seafloor]
extent_east_m = 40
extent_north_m = 20
cell_m = 0.5
material = "plain"
[material.plain]
model = "lambert"
[track]
pings = 9
[sonar.left-right]
range_m = 15
bins = 100
elevations = 128
[run]
block_pings = 4
)";

}  // namespace ensonify::tests
