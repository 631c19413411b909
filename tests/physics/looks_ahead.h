#pragma once

#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <ensonify/engine/simulate.h>

// A sonar that looks ahead, over a level bed.

namespace ensonify::tests {

using namespace engine;

/// A level bed, `depth_m` deep; `more` is TOML that follows.
inline std::string level_scene(double depth_m, const std::string& more) {
  return fmt::format(R"(
version = 1
texture = false
[seafloor]
extent_east_m = 80
extent_north_m = 80
cell_m = 0.5
depth_m = {}
material = "fine sand"
[seafloor.fractal]
height_at_1m_m = 0
[sonar.ahead]
kind = "imaging"
range_m = 25
bins = 800
beams = 257
noise = false
side_lobes = 3
elevations = 256
{})",
                     depth_m, more);
}

inline std::vector<EchoLine> ping(Simulator& simulator, const Pose& pose) {
  const std::span<const EchoLine> lines = simulator.ping(pose);
  return {lines.begin(), lines.end()};
}

/// A pose that looks north, at a height over the bed.
inline Pose over_bed(double depth_m, double height_m) {
  return {.position = {0.0, 0.0, height_m - depth_m}};
}

}  // namespace ensonify::tests
