#pragma once

#include <string>

#include "support/catch.h"

namespace ensonify::tests {

/// A small, fast dataset with every product: eight samples over four small beds.
inline const std::string tiny_recipe = R"(version = 1
seed = 0
[dataset]
samples = 8
seafloors = 4
renders = 2
ground_px_m = 0.25
[dataset.tiles]
width_px = 64
height_px = 8
stride = 0.9
[dataset.chips]
size_px = 9
backgrounds = 1
[dataset.split]
train = 2
val = 1
test = 1
[seafloor]
extent_east_m = 40
extent_north_m = 20
cell_m = 0.25
depth_m = { uniform = [12, 20] }
material = "plain"
[material.plain]
model = "lambert"
[[objects]]
shape = { choice = ["box", "cylinder"] }
class = { by = "objects.0.shape", table = { box = "crate", cylinder = "mine" } }
material = "plain"
east_m = { times = "sonar.left-right.range_m", uniform = [0.4, 0.7], stratified = true }
heading_deg = { uniform = [0, 360], stratified = true }
[track]
pings = 16
speed_mps = 5
ping_interval_s = 0.1
altitude_m = { uniform = [2, 4] }
[sonar.left-right]
range_m = 12
bins = 80
elevations = 160
[run]
block_pings = 4
[display]
gain_db = { uniform = [-3, 3] }
[output]
npz = true
xtf = true
jsf = true
)";

/// A recipe's text with its first `from` replaced.
inline std::string changed(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace ensonify::tests
