#pragma once

#include <string>
#include <vector>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::bench {

/// Something to time: a scene, whose surface, intersector and size its name tells.
struct Case {
  std::string name;  ///< scene/faces/surface/intersector
  engine::Scene scene;
};

/// The same square of rippled sand, cut into more or fewer faces, under about 65,536 rays a ping.
engine::Scene ripples(double faces);

/// A square of 500 m with the heights of a rough bed, 15 m under the sonar.
engine::Scene fractal(double faces);

/// Every case there is, the one that ratios refer to first.
std::vector<Case> all_cases();

}  // namespace ensonify::bench
