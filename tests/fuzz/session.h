#pragma once

#include <ensonify/engine/session_keys.h>

namespace ensonify::tests {

/// The scene of a session that pings fast.
inline engine::SessionScene session_scene() {
  return {R"(version = 1
[seafloor]
extent_east_m = 8
extent_north_m = 8
cell_m = 1
material = "plain"
[material.plain]
model = "lambert"
[track]
pings = 2
[sonar.left-right]
range_m = 15
bins = 20
elevations = 32
)",
          "fuzz",
          {},
          {}};
}

}  // namespace ensonify::tests
